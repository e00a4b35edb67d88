"use strict";
// Numbers sort as numbers, by the one that a cell begins with ("1.2e-3 ± 4e-5", "2·10⁻³"); texts follow them. A mark
// stands before the text, which is thus the last child.
const raised = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const exponentOf = text => text.replace(/⁻/g, "-").replace(/[⁰-⁹¹²³]/g, digit => raised.indexOf(digit));
const valueOf = cell => {
  const text = (cell.lastChild ?? cell).textContent.trim();
  const plain = text.replace(/−/g, "-").replace(/(?:(\d)[·×])?\b10(⁻?[⁰-⁹¹²³]+)/g,
    (all, digit, exponent) => (digit ?? 1) + "e" + exponentOf(exponent));
  const match = /^[<>≤≥≈~=]?\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(?![\w.])/i.exec(plain);
  return { number: match ? parseFloat(match[1]) : Infinity, text };
};
for (const head of document.querySelectorAll("th")) {
  head.querySelector("button")?.addEventListener("click", () => {
    const descending = head.getAttribute("aria-sort") === "ascending";
    for (const other of head.parentNode.children) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", descending ? "descending" : "ascending");
    const body = head.closest("table").tBodies[0];
    const rows = Array.from(body.rows, row => ({ row, value: valueOf(row.cells[head.cellIndex]) }));
    rows.sort((a, b) => {
      const order = a.value.number === b.value.number ? a.value.text.localeCompare(b.value.text, "en", { numeric: true })
                                                      : a.value.number < b.value.number ? -1 : 1;
      return descending ? -order : order;
    });
    body.append(...rows.map(({ row }) => row));
  });
}
// A picture that is higher than wide is shown as a whole. A wide one fits the screen, too; where that makes its text
// small, a click, a tap or Enter enlarges it, and it scrolls. A layout for narrow screens fills their width.
const kLegible = 44 * 16; // pixels, as in report.css
for (const picture of document.querySelectorAll(".still img")) {
  const box = picture.closest(".still");
  const fit = () => {
    const isNarrow = picture.parentNode !== box && picture.currentSrc !== picture.src;
    const isUpright = picture.naturalWidth < picture.naturalHeight;
    picture.classList.toggle("upright", isUpright && !isNarrow);
    box.classList.toggle("enlarges", !isUpright && !isNarrow && box.clientWidth < Math.min(kLegible, picture.naturalWidth));
    if (!box.classList.contains("enlarges")) box.classList.remove("large");
  };
  const enlarge = () => {
    if (box.classList.contains("enlarges")) box.classList.toggle("large");
  };
  if (picture.complete) fit();
  picture.addEventListener("load", fit);
  addEventListener("resize", fit);
  picture.addEventListener("click", enlarge);
  box.addEventListener("keydown", event => { if (event.key === "Enter") enlarge(); });
}
