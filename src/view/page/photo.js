// One picture: it shows, zooms and pans it, and says what was clicked and dragged. A gesture that moved, or had two
// fingers, never places a point.

import * as geometry from "./geometry.js";
import { drawMarks } from "./marks.js";

const kSlip = 4;         // screen pixels that a click may move
const kGrasp = { mouse: 8, pen: 10, touch: 16 }; // from a landmark that are on it
const kExact = 3;        // from the landmark that a click chooses, where the picture waits for another one
const kMostZoom = 40;    // screen pixels for one of the picture
const kLoupeZoom = 4;

const element = (name, kind, ...children) => {
  const made = document.createElement(name);
  if (kind) made.className = kind;
  made.append(...children);
  return made;
};

const button = (text, label, action) => {
  const made = element("button", "", text);
  made.type = "button";
  made.setAttribute("aria-label", label);
  made.title = label;
  made.addEventListener("click", action);
  return made;
};

export class Photo {
  // `on`: {place(where), move(k, where), dropped(k), choose(k), drop(files), look(where)}
  constructor(side, on) {
    Object.assign(this, { side, on, bitmap: null, size: [1, 1], view: null, fingers: new Map(), gesture: null });
    this.scene = { points: [], labels: [], colours: [], links: [], chosen: -1, doubtful: new Map(), proposal: null, draft: [], awaits: false };
    this.cross = null;
    this.canvas = element("canvas");
    this.loupe = element("canvas", `loupe${side === 1 ? " left" : ""}`);
    this.loupe.hidden = true;
    this.svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    this.svg.setAttribute("aria-hidden", "true");
    this.stage = element("div", "stage", this.canvas, this.svg, this.loupe);
    this.stage.tabIndex = 0;
    this.stage.setAttribute("role", "application");
    this.heading = element("h2", "");
    this.head = element("div", "photo-head", this.heading,
      button("−", "− Zoom out (-)", () => this.zoom(1 / 1.5)), button("+", "+ Zoom in (+)", () => this.zoom(1.5)),
      button("fit", "fit: show the whole picture (0)", () => this.fit()));
    this.root = element("div", "photo", this.head, this.stage);
    this.listen();
    new ResizeObserver(() => this.resize()).observe(this.stage);
  }

  // Whether the cross is in use: the keyboard brought the focus here, or moved it since the last click.
  get isKeyed() { return this.usesKeys && document.activeElement === this.stage; }

  // As it was laid out: to ask the page each time would lay it out at each move of a landmark.
  get room() { return this.laidOut ??= [this.stage.clientWidth, this.stage.clientHeight]; }
  get wide() { return this.room[0]; }
  get high() { return this.room[1]; }

  setPicture(name, size, bitmap) {
    const isOther = this.size[0] !== size[0] || this.size[1] !== size[1] || this.heading.textContent !== name;
    Object.assign(this, { size, bitmap });
    this.heading.textContent = name;
    this.stage.setAttribute("aria-label",
      `${this.side === 0 ? "Left" : "Right"} picture, ${name}: arrow keys move the cross, space places the landmark`);
    if (isOther) this.cross = null;
    if (isOther || !this.view) this.fit();
    else this.draw();
  }

  setScene(scene) {
    this.scene = scene;
    this.draw();
  }

  resize() {
    this.laidOut = this.loupeSide = null;
    if (!this.wide) return;
    const before = this.fitted ? null : this.view;
    if (before) this.draw();
    else this.fit();
  }

  fit() {
    this.view = geometry.fitView(...this.size, this.wide, this.high);
    this.fitted = true;
    this.draw();
  }

  zoom(factor, at = this.cross ? geometry.toScreen(this.view, this.cross) : [this.wide / 2, this.high / 2]) {
    const least = 0.5 * geometry.fitView(...this.size, this.wide, this.high).scale;
    this.view = geometry.zoomAt(this.view, factor, at, least, kMostZoom);
    this.fitted = false;
    this.draw();
  }

  // Brings a place into sight, where it is not.
  reveal(where) {
    const [x, y] = geometry.toScreen(this.view, where);
    if (x > 20 && y > 20 && x < this.wide - 20 && y < this.high - 20) return;
    this.view = geometry.centreOn(this.view, where, this.wide, this.high);
    this.fitted = false;
    this.draw();
  }

  draw() {
    if (!this.view || !this.wide || this.drawing) return;
    this.drawing = requestAnimationFrame(() => {
      this.drawing = 0;
      this.paint();
    });
  }

  pen(canvas, wide, high) {
    const dense = devicePixelRatio || 1;
    if (canvas.width !== Math.round(wide * dense)) canvas.width = Math.round(wide * dense);
    if (canvas.height !== Math.round(high * dense)) canvas.height = Math.round(high * dense);
    const pen = canvas.getContext("2d");
    pen.setTransform(dense, 0, 0, dense, 0, 0);
    pen.clearRect(0, 0, wide, high);
    return pen;
  }

  paintPicture(pen, { scale, x, y }) {
    pen.imageSmoothingEnabled = scale < 3;
    pen.imageSmoothingQuality = "high";
    if (this.bitmap) pen.drawImage(this.bitmap, x, y, scale * this.size[0], scale * this.size[1]);
    else {
      pen.fillStyle = "#ffffff";
      pen.fillRect(x, y, scale * this.size[0], scale * this.size[1]);
    }
  }

  paint() {
    // The picture only where it changed: a move of a landmark draws the marks alone.
    const { scale, x, y } = this.view, now = [this.bitmap, scale, x, y, this.wide, this.high, devicePixelRatio];
    if (!this.painted || now.some((value, i) => value !== this.painted[i])) {
      this.paintPicture(this.pen(this.canvas, this.wide, this.high), this.view);
      this.painted = now;
    }
    drawMarks(this.svg, this.view, { ...this.scene, cross: this.isKeyed ? this.cross : null });
    this.paintLoupe();
  }

  paintLoupe() {
    const { proposal } = this.scene;
    const where = this.hover ?? (proposal ? [proposal.x, proposal.y] : this.isKeyed ? this.cross : null);
    this.loupe.hidden = !where || !this.bitmap;
    if (this.loupe.hidden) return;
    const side = this.loupeSide ??= this.loupe.clientWidth, pen = this.pen(this.loupe, side, side);
    const scale = Math.max(2, kLoupeZoom * this.view.scale);
    const view = geometry.centreOn({ scale, x: 0, y: 0 }, where, side, side);
    this.paintPicture(pen, view);
    pen.lineWidth = 1;
    for (const [colour, width] of [["rgb(16 20 26 / 0.7)", 3], ["#ffffff", 1]]) {
      pen.strokeStyle = colour;
      pen.lineWidth = width;
      pen.beginPath();
      for (const [dx, dy] of [[1, 0], [0, 1]])
        for (const sign of [-1, 1]) {
          pen.moveTo(side / 2 + sign * 5 * dx, side / 2 + sign * 5 * dy);
          pen.lineTo(side / 2 + sign * 18 * dx, side / 2 + sign * 18 * dy);
        }
      pen.stroke();
    }
  }

  at(event) {
    const box = this.stage.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  pictureAt(event) { return geometry.toPicture(this.view, this.at(event)); }

  graspedBy(event) {
    return geometry.nearest(this.scene.points.map(point => Array.isArray(point) ? geometry.toScreen(this.view, point) : null),
      this.at(event), kGrasp[event.pointerType] ?? kGrasp.mouse);
  }

  listen() {
    const { stage } = this;
    stage.addEventListener("pointerdown", event => this.begin(event));
    stage.addEventListener("pointermove", event => this.go(event));
    stage.addEventListener("pointerup", event => this.finish(event));
    stage.addEventListener("pointercancel", event => this.finish(event, true));
    stage.addEventListener("pointerleave", () => { this.hover = null; this.draw(); });
    stage.addEventListener("wheel", event => {
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY * (event.ctrlKey ? 0.01 : 0.0016)), this.at(event));
    }, { passive: false });
    stage.addEventListener("focus", () => {
      this.usesKeys = stage.matches(":focus-visible") && !this.gesture;
      this.cross ??= this.startOfCross();
      this.draw();
    });
    stage.addEventListener("blur", () => this.draw());
    stage.addEventListener("dragover", event => { event.preventDefault(); stage.classList.add("over"); });
    stage.addEventListener("dragleave", () => stage.classList.remove("over"));
    stage.addEventListener("drop", event => {
      event.preventDefault();
      stage.classList.remove("over");
      this.on.drop([...event.dataTransfer.files]);
    });
  }

  startOfCross() {
    const { proposal } = this.scene;
    return proposal ? [proposal.x, proposal.y] : [this.size[0] / 2, this.size[1] / 2];
  }

  begin(event) {
    if (event.button > 1 || !this.view) return;
    this.gesture = { kind: "begins" };
    this.stage.focus({ preventScroll: true });
    this.usesKeys = false;
    this.stage.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, this.at(event));
    if (this.fingers.size > 1) {
      this.gesture = { kind: "pinch" };
      return;
    }
    const grasped = event.button === 0 ? this.graspedBy(event) : -1;
    this.gesture = { kind: "click", from: this.at(event), grasped, pans: event.button === 1 };
    if (grasped >= 0) this.gesture.offset = geometry.toScreen(this.view, this.scene.points[grasped])
      .map((value, c) => value - this.gesture.from[c]);
  }

  go(event) {
    if (!this.view) return;
    if (!this.gesture) {
      this.hover = event.pointerType === "mouse" ? this.pictureAt(event) : null;
      this.draw();
      return;
    }
    const before = this.fingers.get(event.pointerId), now = this.at(event);
    if (!before) return;
    if (this.gesture.kind === "pinch") this.pinch(event.pointerId, before, now);
    this.fingers.set(event.pointerId, now);
    const { gesture } = this;
    if (gesture.kind === "click" && geometry.distance(gesture.from, now) > kSlip) {
      gesture.kind = gesture.grasped >= 0 ? "drag" : "pan";
      this.stage.classList.toggle("pans", gesture.kind === "pan");
    }
    if (gesture.kind === "pan") {
      this.view = geometry.panBy(this.view, now[0] - before[0], now[1] - before[1]);
      this.fitted = false;
      this.hover = null;
      this.draw();
    } else if (gesture.kind === "drag") {
      const where = geometry.toPicture(this.view, now.map((value, c) => value + gesture.offset[c]));
      this.hover = geometry.clampTo(...this.size, where);
      this.on.move(gesture.grasped, this.hover);
    }
  }

  pinch(id, before, now) {
    const other = [...this.fingers].find(([finger]) => finger !== id)?.[1];
    if (!other) return;
    const factor = geometry.distance(now, other) / Math.max(1, geometry.distance(before, other));
    this.view = geometry.panBy(this.view, (now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
    this.zoom(factor, [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2]);
  }

  finish(event, isCancelled = false) {
    const { gesture } = this;
    this.fingers.delete(event.pointerId);
    if (!gesture) return;
    if (this.fingers.size > 0) return;
    this.gesture = null;
    this.stage.classList.remove("pans");
    if (gesture.kind === "drag") this.on.dropped(gesture.grasped);
    if (gesture.kind !== "click" || isCancelled || gesture.pans) return;
    const where = this.pictureAt(event);
    // Landmarks may lie close to one another: a click beside one places the landmark that is waited for.
    const isOn = gesture.grasped >= 0 && (!this.scene.awaits || Math.hypot(...gesture.offset) <= kExact);
    if (isOn) this.on.choose(gesture.grasped);
    else if (geometry.isInside(...this.size, where)) this.on.place(where);
  }

  // Whether the key was for the picture.
  key(event) {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (steps) {
      this.usesKeys = true;
      const far = (event.shiftKey ? 1 : event.altKey ? 40 : 8) / this.view.scale;
      this.cross ??= this.startOfCross();
      this.cross = geometry.clampTo(...this.size, this.cross.map((value, c) => value + far * steps[c]));
      this.hover = null;
      this.reveal(this.cross);
      this.draw();
      return true;
    }
    if (event.key === " ") {
      this.on.place(this.cross ?? this.startOfCross());
      return true;
    }
    return false;
  }
}
