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

// A click on a key of a legend hides its series or shows it again; two clicks, or Shift, leave that series alone.
const nameOf = (key) => key.textContent.trim();
const keysOf = (figure) => [...figure.querySelectorAll("[data-key]")];
const hide = (figure, isHidden) => keysOf(figure).forEach((key) => {
  const off = isHidden(key);
  key.classList.toggle("off", off);
  key.setAttribute("aria-pressed", String(!off));
  figure.querySelectorAll(`[data-series="${key.dataset.key}"]`).forEach((s) => s.classList.toggle("off", off));
});
const isOff = (key) => key.classList.contains("off");
const prepare = (figure) => keysOf(figure).forEach((key) => {
  key.setAttribute("tabindex", "0");
  key.setAttribute("role", "button");
  key.setAttribute("aria-pressed", "true");
});
for (const figure of document.querySelectorAll("figure")) {
  prepare(figure);
  const press = (event, alone) => {
    const pressed = event.target.closest("[data-key]");
    if (!pressed) return;
    event.preventDefault();
    const isAlone = keysOf(figure).every((key) => isOff(key) === (key !== pressed));
    hide(figure, (key) => (alone ? !isAlone && key !== pressed : isOff(key) !== (key === pressed)));
  };
  figure.addEventListener("click", (event) => press(event, event.shiftKey));
  figure.addEventListener("dblclick", (event) => press(event, true));
  figure.addEventListener("keydown", (event) => [" ", "Enter"].includes(event.key) && press(event, event.shiftKey));
}

// The large plot shows the one that is chosen, with the same series hidden.
for (const choice of document.querySelectorAll(".choice")) {
  const section = choice.closest("section");
  const [large, plots] = [section.querySelector(".large"), section.querySelectorAll("details svg")];
  const select = choice.querySelector("select");
  choice.hidden = false;
  select.addEventListener("change", () => {
    const hidden = keysOf(large).filter(isOff).map(nameOf);
    large.replaceChildren(plots[select.selectedIndex].cloneNode(true));
    large.setAttribute("aria-label", select.value);
    prepare(large);
    hide(large, (key) => hidden.includes(nameOf(key)));
  });
}
