// One picture over another: mixed, wiped, in squares by turns, or their difference.
class Stack {
  constructor(figure) {
    this.sheet = figure.querySelector(".sheet");
    this.over = this.sheet.querySelector(".over");
    const below = this.sheet.querySelector("img");  // as wide as the page, unless it is upright
    const fit = () => { this.sheet.style.width = `min(100%, ${85 * below.naturalWidth / below.naturalHeight}vh)`; };
    if (below.complete) fit(); else below.addEventListener("load", fit);
    this.slider = figure.querySelector("input[type=range]");
    this.modes = figure.querySelectorAll("input[type=radio]");
    this.controls = figure.querySelector(".player");
    this.controls.hidden = false;
    const area = figure.querySelector(".stack");
    area.style.position = "relative";
    this.zoom = new Zoom(area, () => this.show());
    this.zoom.listenTo(figure.querySelectorAll("[data-zoom]"));
    for (const input of [this.slider, ...this.modes]) input.addEventListener("input", () => this.show());
    this.show();
  }
  show() {
    const mode = Array.from(this.modes).find(one => one.checked).value, part = this.slider.value / this.slider.max;
    const { style } = this.over, side = 3 + 22 * (1 - part);
    style.opacity = mode === "mix" ? part : 1;
    style.clipPath = mode === "wipe" ? `inset(0 0 0 ${100 * (1 - part)}%)` : "";
    style.mixBlendMode = mode === "difference" ? "difference" : "";
    const squares = mode === "squares" ? "repeating-conic-gradient(#000 0 25%, transparent 0 50%)" : "";
    style.maskImage = style.webkitMaskImage = squares;
    style.maskSize = style.webkitMaskSize = squares ? `${side}vmin ${side}vmin` : "";
    this.slider.disabled = mode === "difference";
    const { factor, shift: [x, y] } = this.zoom;
    const left = this.sheet.offsetLeft, top = this.sheet.offsetTop;  // of the area, about which it is zoomed
    this.sheet.style.transform = `translate(${x + (factor - 1) * left}px, ${y + (factor - 1) * top}px) scale(${factor})`;
    this.sheet.classList.toggle("large", factor > 3);
  }
}
for (const figure of document.querySelectorAll("figure.stacked")) new Stack(figure);
