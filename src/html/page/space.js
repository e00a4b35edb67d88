// Shapes about a template by their scores: sliders, and a map on which a click shows the shape there, or a specimen's.
const svgNode = (name, attributes, ...children) => {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
};
const signed = value => (value < 0 ? "−" : "+") + Math.abs(value).toFixed(1);
class ShapeSpace extends Motion {
  constructor(figure) {
    super(figure);
    this.sliders = Array.from(figure.querySelectorAll("[data-score]"));
    this.outputs = this.sliders.map(slider => slider.parentNode.querySelector("output"));
    this.picker = figure.querySelector("select");
    this.map = figure.querySelector("svg.map");
    this.mean = this.image;
    this.active = 0;
    this.sliders.forEach((slider, k) => slider.addEventListener("input", () => {
      this.active = k;
      this.stop();
      this.show(null);
    }));
    this.picker.addEventListener("change", () => this.choosePlace(this.picker.value === "" ? null : Number(this.picker.value)));
    figure.querySelector("[data-reset]").addEventListener("click", () => {
      this.stop();
      this.setScores(this.sliders.map(() => 0));
      this.show(null);
    });
    this.map.addEventListener("click", event => this.clickMap(event));
    this.drawMap();
    this.draw();
  }
  get scores() { return this.sliders.map(slider => slider.value / 100); }
  setScores(scores) { this.sliders.forEach((slider, k) => { slider.value = Math.round(100 * scores[k]); }); }
  // Of the polynomial; the template's landmarks stay where they are drawn as such.
  placesOf(places) {
    const { frames, grid, terms, gridTerms, powers } = this.data;
    const of = places === frames ? terms : places === grid ? gridTerms : null;
    if (!of || !this.sliders) return places[0];
    const weights = powers.map(all => all.reduce((product, power, k) => product * this.scores[k] ** power, 1));
    const sum = new Float64Array(of[0].length);
    of.forEach((term, t) => { for (let i = 0; weights[t] && i < sum.length; ++i) sum[i] += weights[t] * term[i]; });
    return Array.from(sum);
  }
  setTime() {
    this.now = { k: 0, time: 0, low: 0 };
    this.outputs.forEach((output, k) => {
      output.textContent = signed(this.scores[k]) + " s.d.";
      this.sliders[k].setAttribute("aria-valuetext", output.textContent);
    });
  }
  draw() {
    if (!this.map) return; // called by the constructor of Motion
    super.draw();
    const [x, y] = this.onMap(this.scores);
    this.here?.setAttribute("transform", `translate(${x} ${y})`);
  }
  // Once along the score that was moved last: up, down and back to the mean.
  play() {
    const seconds = this.still.matches ? 12 : 5, most = Math.min(2, this.data.range), before = this.scores;
    let begin;
    const step = now => {
      begin ??= now;
      const part = Math.min(1, (now - begin) / 1000 / seconds);
      this.setScores(before.map((score, k) => k === this.active ? most * Math.sin(2 * Math.PI * part) : score));
      this.draw();
      if (part < 1) this.running = requestAnimationFrame(step); else this.stop();
    };
    this.button.textContent = "Pause";
    this.running = requestAnimationFrame(step);
  }
  // A specimen's shape, by its scores, and its picture; null: the mean picture on the shape of the scores.
  show(specimen) {
    this.picker.value = specimen === null ? "" : String(specimen);
    const { picture, scores } = this.data.specimens[specimen] ?? {};
    if (scores) this.setScores(scores.map(score => Math.max(-this.data.range, Math.min(this.data.range, score))));
    if (picture && this.mean) {
      this.own ??= this.mean.cloneNode();
      this.own.onload = () => this.draw();
      this.own.src = picture;
      this.image = this.own;
    } else this.image = this.mean;
    this.dots?.forEach((dot, i) => dot.classList.toggle("chosen", i === specimen));
    this.draw();
  }
  choosePlace(specimen) {
    this.stop();
    this.show(specimen);
  }
  onMap([x, y = 0]) { return [210 + x * this.mapScale, 210 - y * this.mapScale]; }
  clickMap(event) {
    const box = this.map.getBoundingClientRect(), unit = 420 / box.width;
    const x = (event.clientX - box.left) * unit, y = (event.clientY - box.top) * unit;
    let nearest = null, distance = 12;
    this.data.specimens.forEach(({ scores }, i) => {
      const [u, v] = this.onMap(scores), away = Math.hypot(u - x, v - y);
      if (away < distance) [nearest, distance] = [i, away];
    });
    if (nearest === null) {
      const { range } = this.data, within = value => Math.max(-range, Math.min(range, value));
      const scores = this.scores;
      scores[0] = within((x - 210) / this.mapScale);
      if (scores.length > 1) scores[1] = within((210 - y) / this.mapScale);
      this.setScores(scores);
    }
    this.choosePlace(nearest);
  }
  drawMap() {
    const { specimens, range, axes, groupNames } = this.data, colours = this.groupColours();
    const most = Math.max(range, ...specimens.flatMap(({ scores }) => scores.slice(0, 2).map(Math.abs)));
    this.mapScale = 185 / most;
    const line = (x1, y1, x2, y2) => svgNode("line", { x1, y1, x2, y2, class: "axis" });
    const label = (x, y, text, anchor) => svgNode("text", { x, y, "text-anchor": anchor }, text);
    this.map.append(line(15, 210, 405, 210), line(210, 15, 210, 405), label(405, 203, axes[0] + " →", "end"));
    if (axes.length > 1) this.map.append(label(214, 22, axes[1] + " ↑", "start"));
    for (let s = -Math.floor(most); s <= most; ++s) {
      if (!s) continue;
      const at = 210 + s * this.mapScale;
      this.map.append(line(at, 207, at, 213), label(at, 226, String(s), "middle"));
    }
    this.dots = specimens.map(({ name, group, scores }) => {
      const [cx, cy] = this.onMap(scores), dot = svgNode("circle", { cx, cy, r: 5 }, svgNode("title", {}, name));
      dot.style.fill = colours[group % colours.length];
      return dot;
    });
    this.here = svgNode("path", { d: "M-9 0H9M0 -9V9", class: "here" });
    this.map.append(...this.dots, this.here);
    const list = this.figure.querySelector(".groups");
    groupNames.forEach((name, g) => {
      const item = document.createElement("li");
      item.textContent = name;
      item.style.setProperty("--own", colours[g % colours.length]);
      list.append(item);
    });
  }
}
for (const figure of document.querySelectorAll("figure.space")) new ShapeSpace(figure);
