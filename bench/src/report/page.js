for (const table of document.querySelectorAll("table.sortable")) {
  const heads = [...table.querySelectorAll("th")];
  heads.forEach((head, column) => head.addEventListener("click", () => {
    const up = head.getAttribute("aria-sort") !== "ascending";
    heads.forEach((h) => h.setAttribute("aria-sort", "none"));
    head.setAttribute("aria-sort", up ? "ascending" : "descending");
    const key = (row) => {
      const cell = row.cells[column];
      return cell.dataset.sort === undefined ? cell.textContent : Number(cell.dataset.sort);
    };
    const number = (x) => typeof x === "number";
    const order = (a, b) => (number(a) && number(b) ? (a > b) - (a < b) : String(a).localeCompare(String(b)));
    // What was not measured stands last either way.
    const none = (x) => number(x) && !Number.isFinite(x);
    const body = table.tBodies[0];
    const rows = [...body.rows].sort((p, q) => {
      const [a, b] = [key(p), key(q)];
      return none(a) || none(b) ? none(a) - none(b) : order(a, b) * (up ? 1 : -1);
    });
    body.append(...rows);
  }));
}
