// A field above every table of the class "searchable"; rows without its words are hidden.
document.addEventListener("DOMContentLoaded", () => {
  for (const table of document.querySelectorAll("table.searchable")) {
    const field = document.createElement("input");
    field.className = "table-filter";
    field.type = "search";
    field.placeholder = "Search this table: words of a row";
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

// Each cell knows its column's name: on a narrow screen rows of words are shown as cards (book.css),
// while a table of numbers stays one, which scrolls.
document.addEventListener("DOMContentLoaded", () => {
  for (const table of document.querySelectorAll(".bd-article table")) {
    const head = table.tHead && table.tHead.rows[0];
    if (table.classList.contains("dataframe") || !table.tBodies[0]) continue;
    const rows = [...table.tBodies[0].rows].map((row) => [...row.cells]);
    const values = rows.flatMap((cells) => cells.slice(1).map((cell) => cell.textContent.trim()));
    const ofNumbers = !table.classList.contains("stacked") && values.length > rows.length && values.every((text) => text && text.length < 32);
    table.classList.add(ofNumbers ? "numbers" : "stacked");
    for (const cells of rows) {
      cells.forEach((cell, k) => {
        const filled = cell.textContent.trim() || cell.querySelector("img, svg, math, input");
        const column = head && head.cells[k] && head.cells[k].textContent.trim();
        if (filled && column) cell.dataset.column = column;
        if (!filled) cell.classList.add("empty");
      });
    }
  }
});

// A picture fits its column; a tap opens it at its full size.
document.addEventListener("DOMContentLoaded", () => {
  for (const image of document.querySelectorAll(".bd-article img")) {
    if (image.closest("a, .sd-card")) continue;
    const link = document.createElement("a");
    link.className = "picture";
    link.href = image.src;
    image.replaceWith(link);
    link.append(image);
  }
});
