#include "html_style.hpp"

namespace pulson::html {

std::string_view style() {
  return R"(
:root {
  color-scheme: light dark;
  --paper: #fbfbfa; --surface: #ffffff; --ink: #1f2733; --text: #3c4551; --quiet: #6a7380; --line: #e2e5e9;
  --holds: #1d7a56; --holds-tint: #e4f3ec; --fails: #a82b55; --fails-tint: #fae6ec;
  --open: #6a6355; --open-tint: #f0ede6; --focus: #4c6a92;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #14181e; --surface: #1b2129; --ink: #eef1f5; --text: #c6cdd6; --quiet: #919ba8; --line: #2d3540;
    --holds: #6fcfa5; --holds-tint: #17352a; --fails: #f291ae; --fails-tint: #41202b;
    --open: #c3b99f; --open-tint: #322e25; --focus: #8fb0dd;
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; text-size-adjust: 100%; }
body {
  margin: 0; background: var(--paper); color: var(--text);
  font: 1.0625rem/1.6 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", "Noto Sans", sans-serif;
}
main, footer { max-width: 68rem; margin: 0 auto; padding: 0 1.25rem; }
main { padding-top: clamp(1.75rem, 5vw, 4rem); }
h1, h2 { color: var(--ink); font-weight: 600; line-height: 1.2; letter-spacing: -0.012em; text-wrap: balance; }
h1 { margin: 0; font-size: clamp(1.75rem, 1.3rem + 2vw, 2.5rem); overflow-wrap: anywhere; }
h2 { margin: 0 0 1rem; font-size: 1.4rem; overflow-wrap: anywhere; }
p { max-width: 42rem; margin: 0 0 1rem; overflow-wrap: break-word; }
.lead { margin-top: 0.9rem; font-size: 1.1875rem; line-height: 1.5; color: var(--quiet); }
section { margin-top: clamp(2.25rem, 5vw, 3.5rem); }
figure { margin: 1.5rem 0 2rem; }
figure img { display: block; max-width: 100%; height: auto; border: 1px solid var(--line); border-radius: 8px;
  background: #fff; }
figcaption { max-width: 42rem; margin-top: 0.6rem; font-size: 0.9375rem; line-height: 1.5; color: var(--quiet); }
figcaption.above { margin: 0 0 0.6rem; }
.box { overflow-x: auto; border: 1px solid var(--line); border-radius: 8px; background: var(--surface); }
.box:focus-visible, th button:focus-visible { outline: 2px solid var(--focus); outline-offset: -2px; }
table { width: 100%; border-collapse: collapse; font-size: 0.9375rem; line-height: 1.45;
  font-variant-numeric: tabular-nums; }
th, td { padding: 0.55rem 0.9rem; text-align: left; vertical-align: top; white-space: nowrap; }
td { border-top: 1px solid var(--line); }
td.long { min-width: 16rem; white-space: normal; }
td.number, th.number { text-align: right; }
th { padding: 0; color: var(--quiet); font-weight: 600; }
th button { display: block; width: 100%; padding: 0.6rem 0.9rem; border: 0; background: none; color: inherit;
  font: inherit; text-align: inherit; white-space: nowrap; cursor: pointer; }
th button:hover, th[aria-sort] button { color: var(--ink); }
th button::after { content: "\2195"; margin-left: 0.4em; opacity: 0.4; }
th[aria-sort=ascending] button::after { content: "\2191"; opacity: 1; }
th[aria-sort=descending] button::after { content: "\2193"; opacity: 1; }
.verdict { display: inline-block; padding: 0 0.55em; border-radius: 1em; font-size: 0.8125rem; font-weight: 600;
  line-height: 1.65; white-space: nowrap; }
.holds { color: var(--holds); background: var(--holds-tint); }
.fails { color: var(--fails); background: var(--fails-tint); }
.open { color: var(--open); background: var(--open-tint); }
.outlier { margin-right: 0.45em; font-size: 0.8em; color: var(--fails); }
td .verdict { margin-right: 0.5em; padding: 0 0.45em; }
.claims { max-width: 52rem; margin: 1.25rem 0 1.75rem; padding: 0; border-bottom: 1px solid var(--line);
  list-style: none; }
.claims li { display: grid; grid-template-columns: 9.5rem minmax(0, 1fr); gap: 0.1rem 1rem; align-items: baseline;
  padding: 0.75rem 0; border-top: 1px solid var(--line); }
.claims .verdict { justify-self: start; }
.claims .claim { color: var(--ink); overflow-wrap: anywhere; }
.claims .measured { grid-column: 2; font-size: 0.9375rem; color: var(--quiet); overflow-wrap: anywhere; }
footer { margin-top: clamp(2.5rem, 6vw, 4.5rem); padding-bottom: 3rem; font-size: 0.875rem; color: var(--quiet); }
footer > div { padding-top: 1.1rem; border-top: 1px solid var(--line); }
footer p { margin: 0 0 0.5rem; }
pre { margin: 0 0 0.75rem; padding: 0.75rem 0.9rem; border: 1px solid var(--line); border-radius: 8px;
  background: var(--surface); color: var(--text); white-space: pre-wrap; overflow-wrap: anywhere; }
code { font: 0.8125rem/1.5 ui-monospace, SFMono-Regular, Menlo, Consolas, "DejaVu Sans Mono", monospace; }
@media (max-width: 36rem) {
  .claims li { grid-template-columns: minmax(0, 1fr); gap: 0.35rem; }
  .claims .measured { grid-column: 1; }
}
@media print { body { background: #fff; } figure, .claims li, tr { break-inside: avoid; } }
)";
}

std::string_view player_style() {
  return R"css(
:root {
  --grid: #c3ccd6; --goal: #b04a12;
  --g0: #1f5fa8; --g1: #1d7a56; --g2: #7b3fa0; --g3: #a06a00; --g4: #0b7c8c; --g5: #a82b55; --g6: #5b6470;
  --g7: #4b4bb5;
}
@media (prefers-color-scheme: dark) {
  :root {
    --grid: #3c4857; --goal: #f0a46b;
    --g0: #7db4f5; --g1: #6fcfa5; --g2: #cf9bf0; --g3: #e6c05c; --g4: #66cfdd; --g5: #f291ae; --g6: #b4bcc8;
    --g7: #a5a5ff;
  }
}
.motion canvas { display: block; width: 100%; border: 1px solid var(--line); border-radius: 8px;
  background: var(--surface); touch-action: pan-y; }
.motion canvas[tabindex] { cursor: grab; }
.player { display: flex; align-items: center; gap: 0.9rem; margin-top: 0.75rem; }
.player button { min-width: 5.2em; padding: 0.4rem 0.9rem; border: 1px solid var(--line); border-radius: 8px;
  background: var(--surface); color: var(--ink); font: inherit; font-size: 0.9375rem; cursor: pointer; }
.player button:hover { border-color: var(--focus); }
.player input { flex: 1; min-width: 0; height: 1.5rem; margin: 0; accent-color: var(--focus); }
.player output { min-width: 5.5em; font-size: 0.9375rem; font-variant-numeric: tabular-nums; color: var(--quiet); }
.motion canvas:focus-visible, .player button:focus-visible, .player input:focus-visible {
  outline: 2px solid var(--focus); outline-offset: 2px; }
.key { display: flex; flex-wrap: wrap; gap: 0.1rem 1.3rem; margin: 0.6rem 0 0; padding: 0; list-style: none;
  font-size: 0.875rem; color: var(--quiet); }
.key li::before { content: "●"; margin-right: 0.45em; }
.key .start::before { opacity: 0.5; }
.key .moving::before { color: var(--g0); }
.key .goal::before { content: "○"; font-weight: 700; color: var(--goal); }
.key .odd::before { content: "▲"; color: var(--fails); }
@media print { .player { display: none; } }
)css";
}

std::string_view script() {
  return R"(
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
  head.querySelector("button").addEventListener("click", () => {
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
)";
}

}  // namespace pulson::html
