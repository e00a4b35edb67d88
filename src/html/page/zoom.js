// Zoom and pan of one element: a place p in it is shown at shift + factor p.
class Zoom {
  constructor(area, changed, drags = () => this.factor > 1) {
    Object.assign(this, { area, changed, drags, factor: 1, shift: [0, 0], pointers: new Map() });
    area.addEventListener("wheel", event => {
      // The page scrolls, unless what is below the pointer has the focus.
      if (!event.ctrlKey && document.activeElement !== area) return;
      event.preventDefault();
      this.by(Math.exp(-event.deltaY / 400), this.placeOf(event));
    }, { passive: false });
    area.addEventListener("pointerdown", event => {
      this.pointers.set(event.pointerId, this.placeOf(event));
      if (this.drags() || this.pointers.size > 1) area.setPointerCapture(event.pointerId);
    });
    area.addEventListener("pointermove", event => this.moved(event));
    for (const end of ["pointerup", "pointercancel", "pointerleave"])
      area.addEventListener(end, event => this.pointers.delete(event.pointerId));
    area.addEventListener("dblclick", () => this.reset());
    area.addEventListener("keydown", event => {
      const step = 40, moves = { ArrowLeft: [step, 0], ArrowRight: [-step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.key === "+" || event.key === "=") this.by(1.25);
      else if (event.key === "-") this.by(0.8);
      else if (event.key === "0") this.reset();
      else if (event.key in moves && this.factor > 1) this.move(...moves[event.key]);
      else return;
      event.preventDefault();
    });
  }
  placeOf(event) {
    const box = this.area.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }
  moved(event) {
    const before = this.pointers.get(event.pointerId), now = this.placeOf(event);
    if (!before) return;
    this.pointers.set(event.pointerId, now);
    if (this.pointers.size === 1) return this.drags() && this.move(now[0] - before[0], now[1] - before[1]);
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
    const apart = place => Math.hypot(place[0] - other[0], place[1] - other[1]);
    this.by(apart(now) / Math.max(apart(before), 1), [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2]);
  }
  get size() { return [this.area.clientWidth, this.area.clientHeight]; }
  by(ratio, place = this.size.map(side => side / 2)) {
    const factor = Math.max(1, Math.min(40, this.factor * ratio));
    this.shift = this.shift.map((shift, i) => place[i] - factor / this.factor * (place[i] - shift));
    this.factor = factor;
    this.move(0, 0);
  }
  move(right, down) {
    this.shift = [right, down].map((by, i) => Math.min(0, Math.max(this.size[i] * (1 - this.factor), this.shift[i] + by)));
    this.area.style.touchAction = this.factor > 1 ? "none" : "";
    this.changed();
  }
  reset() {
    this.factor = 1;
    this.move(0, 0);
  }
  // Buttons whose data-zoom is a ratio; 0 resets.
  listenTo(buttons) {
    for (const button of buttons)
      button.addEventListener("click", () => Number(button.dataset.zoom) ? this.by(Number(button.dataset.zoom)) : this.reset());
  }
}
