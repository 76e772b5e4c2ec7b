"use strict";
// Tables whose headings sort their rows, by mouse or keyboard; rows without a value stay at the end.

function valueOf(cell, column) {
  if (!cell || cell.colSpan > 1) return null;
  if (cell.dataset.value !== undefined) return Number(cell.dataset.value);
  const text = (column ? cell.textContent : cell.firstChild ? cell.firstChild.textContent : "").trim();
  const number = /^[<\u2212-]?\s*[\d.]+(e[+-]?\d+)?/.exec(text);
  return text === "" || text === "–" ? null : number ? Number(number[0].replace("<", "").replace("\u2212", "-")) : text;
}
function sortable(table) {
  const body = table.tBodies[0], heads = [...table.tHead.rows[table.tHead.rows.length - 1].cells];
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      heads.forEach((each) => each.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const order = ([a], [b]) => {
        if (a === null || b === null) return (a === null) - (b === null);
        const both = typeof a === "number" && typeof b === "number";
        return (up ? 1 : -1) * (both ? a - b : String(a).localeCompare(String(b)));
      };
      const rows = [...body.rows].map((row) => [valueOf(row.cells[column], column), row]).sort(order);
      body.append(...rows.map(([, row]) => row));
    });
  });
}
function sortTables() {
  document.querySelectorAll("table").forEach(sortable);
}
