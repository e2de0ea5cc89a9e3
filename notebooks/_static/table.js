// A field above every table of the class "searchable"; rows without its words are hidden.
document.addEventListener("DOMContentLoaded", () => {
  for (const table of document.querySelectorAll("table.searchable")) {
    const field = document.createElement("input");
    field.className = "table-filter";
    field.type = "search";
    field.placeholder = "Search this table: words of a row, such as misprint, Sec. III, threshold";
    field.setAttribute("aria-label", "Search this table");
    const home = table.closest(".pst-scrollable-table-container") || table;
    home.parentNode.insertBefore(field, home);
    const rows = [...table.tBodies[0].rows];
    field.addEventListener("input", () => {
      const words = field.value.toLowerCase().split(/\s+/);
      for (const row of rows) {
        const text = row.textContent.toLowerCase();
        row.hidden = !words.every((word) => text.includes(word));
      }
    });
  }
});
