// The live result: the left picture carried onto the right one, with what the map does.

import { match } from "./api.js";
import { WarpView, between } from "./warp.js";

const kLongerSide = 33; // nodes of the grid along the longer side
const kSlow = 40;       // milliseconds of the program, above which something quicker is shown first
const kPause = 120;     // milliseconds without a move, until what is slow is asked for
const kFewest = 3;      // landmarks on both pictures
const kHighest = 36;    // per cent of the window that the picture is high at most, so that the list has room

export const element = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes))
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value === true) made.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(key, value);
  made.append(...children);
  return made;
};

export const gridFor = ([width, height]) => {
  const by = (kLongerSide - 1) / Math.max(width, height);
  return { columns: Math.max(2, Math.round(by * width) + 1), rows: Math.max(2, Math.round(by * height) + 1) };
};

export class Result {
  // `tell(map, error)` hears of each match.
  constructor(root, tell) {
    Object.assign(this, { root, tell, map: null, wanted: null, busy: 0, turn: 0, isQuick: false, key: "", bitmaps: [null, null], size: [4, 3] });
    this.look = { time: 1, blend: 0.6, mode: 0, growth: false, folds: true, grid: true, points: true };
    this.noise = { on: false, beta: 5 };
    this.build();
    new ResizeObserver(() => this.draw()).observe(this.box);
  }

  range(label, key, format) {
    const output = element("output", {}, format(this.look[key]));
    const input = element("input", { type: "range", min: 0, max: 1, step: 0.01, value: this.look[key], "aria-label": label,
      oninput: event => {
        this.look[key] = Number(event.target.value);
        output.textContent = format(this.look[key]);
        this.draw();
      } });
    return [element("span", {}, label, " ", output), input];
  }

  check(label, key) {
    return element("label", {}, element("input", { type: "checkbox", checked: this.look[key],
      onchange: event => { this.look[key] = event.target.checked; this.draw(); this.showLegend(); } }), label);
  }

  build() {
    this.status = element("p", { class: "quiet", role: "status" });
    this.heading = element("h2", { id: "result-heading" }, "One picture onto the other");
    this.canvas = element("canvas", { role: "img", "aria-label": "The left picture carried onto the right one" });
    this.over = element("canvas", { "aria-hidden": "true" });
    this.note = element("p", {}, `With ${kFewest} landmarks on both pictures the left one is carried onto the right one here.`);
    this.box = element("div", { class: "view" }, this.canvas, this.over, this.note);
    const percent = value => `${Math.round(100 * value)} %`;
    const mode = element("select", { "aria-label": "How the pictures are laid over one another",
      onchange: event => { this.look.mode = Number(event.target.value); this.draw(); } },
    ...["mix", "wipe", "difference"].map((name, i) => element("option", { value: i }, name)));
    this.beta = element("input", { type: "range", min: 0.5, max: 20, step: 0.5, value: this.noise.beta, disabled: true,
      "aria-label": "Strength of the noise, per cent of the diameter",
      oninput: event => { this.noise.beta = Number(event.target.value); this.showBeta(); this.again(); } });
    this.betaText = element("output", {});
    const noise = element("label", {}, element("input", { type: "checkbox",
      onchange: event => { this.noise.on = event.target.checked; this.beta.disabled = !this.noise.on; this.showBeta(); this.again(); } }),
    "noise");
    this.legend = element("div", { class: "wide quiet" });
    this.root.replaceChildren(
      element("div", { class: "result-head" }, this.heading, this.status),
      this.box,
      element("div", { class: "controls" },
        ...this.range("time", "time", percent), element("label", {}, mode), this.range("blend", "blend", percent)[1],
        element("div", { class: "wide" }, this.check("grid", "grid"), this.check("growth", "growth"), this.check("folds", "folds"),
          this.check("landmarks", "points")),
        element("span", {}, noise, " ", this.betaText), this.beta, this.legend));
    this.showBeta();
    this.showLegend();
    try {
      this.gl = new WarpView(this.canvas);
    } catch (error) {
      this.note.textContent = error.message;
    }
  }

  showBeta() {
    this.betaText.textContent = this.noise.on ? `β ${this.noise.beta} %` : "";
  }

  showLegend() {
    const parts = [];
    if (this.look.growth) parts.push("area ÷4 ", element("span", { class: "swatch" }), " ×4");
    if (this.look.folds && this.map?.folded_fraction > 0)
      parts.push(parts.length ? "; " : "", `folds on ${(100 * this.map.folded_fraction).toFixed(1)} % of the picture, in magenta`);
    this.legend.replaceChildren(...parts);
  }

  async setPictures(bitmaps, sizes, names) {
    this.heading.textContent = `${names[0]} onto ${names[1]}`;
    this.sizes = sizes;
    this.size = sizes[1];
    this.bitmaps = bitmaps;
    this.box.style.aspectRatio = `${this.size[0]} / ${this.size[1]}`;
    this.box.style.width = `min(100%, ${(kHighest * this.size[0] / this.size[1]).toFixed(2)}vh)`;
    if (this.gl) for (const unit of [0, 1]) await this.gl.setPicture(unit, bitmaps[unit]);
    this.draw();
  }

  again() {
    if (this.last) this.update(...this.last, true);
  }

  // Asks for the match of these points, where they changed.
  update(left, right, isForced = false) {
    this.last = [left, right];
    if (!this.sizes) return;
    const both = left.filter((point, k) => Array.isArray(point) && Array.isArray(right[k])).length;
    const key = JSON.stringify([left, right, this.sizes, this.noise.on && this.noise.beta]);
    if (key === this.key && !isForced) return;
    this.key = key;
    if (both < kFewest) {
      this.map = null;
      this.wanted = null;
      ++this.turn; // what is on its way is not wanted
      this.note.hidden = false;
      this.status.textContent = `${both} of ${kFewest} landmarks`;
      this.tell(null, null);
      this.draw();
      return;
    }
    const [width, height] = this.sizes[0];
    this.wanted = { left, right, width, height, ...gridFor(this.sizes[0]),
      noise: this.noise.on ? `ch-sd:beta=${this.noise.beta}%` : "none" };
    this.asked = performance.now();
    if (!this.isQuick) this.next();
  }

  // What is asked for before a match in full, if anything. That is the match of `register`, which fits the kernel anew and
  // looks for other minima: where it is slow, one comes first that follows the last, and where that is slow, too, the
  // linear model with its kernel.
  quickRequest({ noise, left }) {
    const { matched, followed } = this;
    if (!matched || 1000 * matched.seconds <= kSlow || noise !== matched.noise) return null;
    const isSlow = followed?.count === left.length && 1000 * followed.seconds > kSlow;
    return isSlow && noise === "none" ? { linear: matched.kernel, ridge: matched.ridge } : { follow: true };
  }

  // One quick request at a time; a slow one is given up for the next.
  async next() {
    const request = this.wanted, begun = this.asked, turn = ++this.turn, quick = this.quickRequest(request);
    const isNewest = () => turn === this.turn && !this.wanted;
    this.wanted = null;
    ++this.busy;
    this.isQuick = true;
    const isShown = await this.show({ ...request, ...quick }, begun, () => turn === this.turn, !quick);
    this.isQuick = false;
    if (this.wanted) this.next();
    for (let isOpen = quick !== null || !isShown; isOpen;) {
      await new Promise(done => setTimeout(done, kPause));
      isOpen = isNewest() && !await this.show(request, begun, isNewest, true);
    }
    --this.busy;
  }

  // Shows what the program answers, where it is still wanted. Resolves to false where a quicker request came before.
  async show(request, begun, isWanted, isLast) {
    try {
      const map = await match(request);
      if (map === null) return false;
      if (isWanted()) this.take(map, request, begun, isLast);
    } catch (error) {
      if (isLast && isWanted()) {
        this.status.textContent = error.message;
        this.tell(null, error);
      }
    }
    return true;
  }

  remember({ linear, followed, seconds, kernel, ridge }, { noise, left }) {
    if (followed) this.followed = { seconds, count: left.length };
    else if (!linear) this.matched = { seconds, kernel, ridge, noise };
  }

  take(map, request, begun, isLast) {
    this.remember(map, request);
    this.map = map;
    this.note.hidden = Boolean(this.gl);
    this.gl?.setMap(map);
    this.status.textContent = map.linear ? "linear model …"
      : `off by ${map.rms.toPrecision(2)} px${map.converged ? "" : ", not converged"}${isLast ? "" : " …"}`;
    this.paint();
    performance.measure(begun !== this.shownOf ? "pulson:effect" : "pulson:match", { start: begun, end: performance.now() });
    this.shownOf = begun;
    this.showLegend();
    this.tell(map, null);
  }

  draw() {
    this.drawing ??= requestAnimationFrame(() => {
      this.drawing = null;
      this.paint();
    });
  }

  paint() {
    if (!this.gl || !this.box.clientWidth) return;
    this.gl.map = this.map ? this.gl.map : null;
    this.gl.draw({ ...this.look, size: this.size });
    this.paintOver();
  }

  paintOver() {
    const dense = devicePixelRatio || 1, wide = this.box.clientWidth, high = this.box.clientHeight;
    this.over.width = Math.round(wide * dense);
    this.over.height = Math.round(high * dense);
    const pen = this.over.getContext("2d"), by = wide / this.size[0];
    pen.scale(dense, dense);
    if (!this.map) return;
    if (this.look.grid) this.paintGrid(pen, by);
    if (this.look.points) this.paintPoints(pen, by);
  }

  paintGrid(pen, by) {
    const { columns, rows } = this.map, places = between(this.map, this.map.frames, this.look.time), step = 2;
    const path = new Path2D();
    const line = (first, stride, count) => {
      for (let i = 0; i < count; ++i) {
        const k = first + i * stride, to = [by * (places[2 * k] + 0.5), by * (places[2 * k + 1] + 0.5)];
        if (i === 0) path.moveTo(...to);
        else path.lineTo(...to);
      }
    };
    for (let r = 0; r < rows; r += step) line(r * columns, 1, columns);
    for (let c = 0; c < columns; c += step) line(c, columns, rows);
    pen.lineWidth = 2.2;
    pen.strokeStyle = "rgb(255 255 255 / 0.3)";
    pen.stroke(path);
    pen.lineWidth = 0.8;
    pen.strokeStyle = "rgb(20 40 60 / 0.7)";
    pen.stroke(path);
  }

  // Where each landmark is at the time, and what is left to its place on the right; doubtful ones in amber, where the
  // noise acts a ring as wide as its part.
  paintPoints(pen, by) {
    const places = between(this.map, this.map.paths, this.look.time), right = this.last[1];
    const disc = (x, y, r, colour) => {
      pen.beginPath();
      pen.arc(x, y, r, 0, 2 * Math.PI);
      pen.fillStyle = colour;
      pen.fill();
    };
    this.map.landmarks.forEach((k, i) => {
      const [x, y] = [0, 1].map(c => by * (places[2 * i + c] + 0.5)), goal = right[k]?.map(value => by * (value + 0.5));
      if (goal && this.look.time > 0.99) {
        pen.beginPath();
        pen.moveTo(x, y);
        pen.lineTo(...goal);
        pen.lineWidth = 1.6;
        pen.strokeStyle = "#ff5f9e";
        pen.stroke();
      }
      const share = this.map.noise_share[i] ?? 0;
      if (share > 0.05) {
        pen.beginPath();
        pen.arc(x, y, 4 + 7 * share, 0, 2 * Math.PI);
        pen.lineWidth = 2;
        pen.strokeStyle = "#b46cff";
        pen.stroke();
      }
      disc(x, y, 3.6, "#fff");
      disc(x, y, 2.4, this.map.unmatched.includes(k) || this.doubtful?.has(k) ? "#e07b00" : "#1d5c7a");
    });
  }
}
