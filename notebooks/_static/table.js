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

// Each cell knows its column's name: on a narrow screen rows are shown as cards (book.css).
document.addEventListener("DOMContentLoaded", () => {
  for (const table of document.querySelectorAll(".bd-article table")) {
    const head = table.tHead && table.tHead.rows[0];
    if (table.classList.contains("dataframe") || !table.tBodies[0]) continue;
    table.classList.add("stacked");
    for (const row of table.tBodies[0].rows) {
      [...row.cells].forEach((cell, k) => {
        if (head && head.cells[k]) cell.dataset.column = head.cells[k].textContent.trim();
      });
    }
  }
});
