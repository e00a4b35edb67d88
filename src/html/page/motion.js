// Landmarks that move.
class Motion extends MotionView {
  constructor(figure) {
    super();
    this.figure = figure;
    this.canvas = figure.querySelector("canvas");
    this.slider = figure.querySelector("input[type=range]");
    this.layers = new Map();
    for (const box of figure.querySelectorAll("[data-layer]")) {
      this.layers.set(box.dataset.layer, box);
      box.addEventListener("change", () => this.draw());
    }
    this.zoom = new Zoom(this.canvas, () => this.draw(), () => this.data.d < 3 && this.zoom.factor > 1);
    this.zoom.listenTo(figure.querySelectorAll("[data-zoom]"));
    this.button = figure.querySelector("button");
    this.output = figure.querySelector("output");
    this.data = JSON.parse(figure.querySelector("script").textContent);
    this.image = figure.querySelector("img");
    this.image?.addEventListener("load", () => this.draw());
    this.yaw = -0.6;
    this.pitch = 0.45;
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
    figure.hidden = false;
    this.slider.addEventListener("input", () => { this.stop(); this.draw(); });
    this.button.addEventListener("click", () => this.running ? this.stop() : this.play());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    if (this.data.d === 3) this.turnable();
    this.choosable();
    new ResizeObserver(() => this.draw()).observe(this.canvas.parentNode);
    this.draw();
  }
  shows(layer) { return this.layers.get(layer)?.checked ?? true; }
  get part() { return this.slider.value / this.slider.max; }
  stop() {
    cancelAnimationFrame(this.running);
    this.running = 0;
    this.button.textContent = "Play";
  }
  play() {
    const seconds = this.still.matches ? 10 : 4;
    const from = this.part < 1 ? this.part : 0;
    let begin;
    const step = now => {
      begin ??= now;
      const part = Math.min(1, from + (now - begin) / 1000 / seconds);
      this.slider.value = Math.round(part * this.slider.max);
      this.draw();
      if (part < 1) this.running = requestAnimationFrame(step); else this.stop();
    };
    this.button.textContent = "Pause";
    this.running = requestAnimationFrame(step);
  }
  turnable() {
    const turn = (right, down) => {
      this.yaw += right;
      this.pitch = Math.max(-1.57, Math.min(1.57, this.pitch + down));
      this.draw();
    };
    const steps = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
    this.canvas.addEventListener("keydown", event => {
      if (!(event.key in steps)) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      turn(...steps[event.key]);
    }, true);
    this.canvas.addEventListener("pointerdown", event => this.canvas.setPointerCapture(event.pointerId));
    this.canvas.addEventListener("pointermove", event => {
      if (event.buttons && this.zoom.pointers.size < 2) turn(event.movementX * 0.01, event.movementY * 0.01);
    });
  }
  // A landmark below the pointer is chosen with its row of the table, and a row with its landmark.
  choosable() {
    const tables = Array.from(document.querySelectorAll("table"));
    const table = tables.find(one => one.tHead.textContent.trim().startsWith("landmark"));
    this.heads = table ? Array.from(table.tHead.rows[0].cells, cell => cell.textContent) : [];
    const rows = new Map(Array.from(table?.tBodies[0].rows ?? [], row => [row.cells[0].textContent, row]));
    this.rows = this.data.numbers.map(number => rows.get(String(number)));
    this.rows.forEach((row, a) => {
      row?.addEventListener("pointerenter", () => this.choose(a));
      row?.addEventListener("pointerleave", () => this.choose());
    });
    this.canvas.addEventListener("pointermove", event => event.buttons || this.choose(this.landmarkAt(event)));
    this.canvas.addEventListener("pointerleave", () => this.choose());
    this.canvas.addEventListener("keydown", event => {
      const all = this.data.numbers.length, step = { n: 1, p: all - 1 }[event.key];
      if (event.key === "Escape") this.choose();
      else if (event.key === " ") this.button.click();
      else if (step) this.choose(((this.chosen ?? -1 + (event.key === "p")) + step + all) % all);
      else return;
      event.preventDefault();
    });
  }
  choose(landmark) {
    if (landmark === this.chosen) return;
    this.rows[this.chosen]?.classList.remove("chosen");
    this.chosen = landmark;
    this.rows[landmark]?.classList.add("chosen");
    this.draw();
  }
  // The place on the canvas of a landmark at present.
  placeNow(a, now = this.placesOf(this.data.frames)) {
    if (this.data.d > 1) return this.pixel(now, a);
    const { times } = this.data, { scale, left, bottom, right } = this.view, last = times[times.length - 1];
    return [left + (this.now.time - times[0]) / (last - times[0]) * (right - left), bottom - scale * now[a]];
  }
  landmarkAt(event) {
    const now = this.placesOf(this.data.frames);
    let nearest, distance = 14;
    for (let a = 0; a < this.data.numbers.length; ++a) {
      const [x, y] = this.placeNow(a, now), away = Math.hypot(x - event.offsetX, y - event.offsetY);
      if (away < distance) [nearest, distance] = [a, away];
    }
    return nearest;
  }
  drawChosen() {
    const a = this.chosen, { pen } = this;
    if (a === undefined) return;
    const place = this.placeNow(a), cells = Array.from(this.rows[a]?.cells ?? [], cell => cell.textContent);
    const name = this.data.names[a] ? " " + this.data.names[a] : "";
    const text = cells.length ? cells.map((cell, i) => this.heads[i] + " " + cell).join(" · ")
                              : "landmark " + this.data.numbers[a] + name;
    this.canvas.setAttribute("aria-description", text);
    this.dot(place, 9, this.colour("ink"), 1, true);
    pen.textAlign = "left";
    const wide = pen.measureText(text).width + 12;
    const x = Math.max(2, Math.min(place[0] + 12, this.view.wide - wide - 2)), y = Math.max(24, place[1] - 12);
    pen.fillStyle = this.colour("surface");
    pen.globalAlpha = 0.9;
    pen.fillRect(x, y - 16, wide, 22);
    pen.globalAlpha = 1;
    pen.fillStyle = this.colour("ink");
    pen.fillText(text, x + 6, y);
  }
  // The places between two frames; those who prefer less motion see the frames alone.
  placesOf(frames) {
    const { low, k } = this.now, first = frames[k], second = frames[k + 1] ?? first;
    return first.map((place, i) => place + low * (second[i] - place));
  }
  setTime() {
    const { times } = this.data, last = times.length - 1;
    let time = times[0] + this.part * (times[last] - times[0]), k = 0;
    while (k < last && times[k + 1] <= time) ++k;
    if (this.still.matches) time = times[k];
    this.now = { k, time, low: k < last ? (time - times[k]) / (times[k + 1] - times[k]) : 0 };
    this.output.textContent = "t = " + Number(time.toPrecision(3));
    this.slider.setAttribute("aria-valuetext", this.output.textContent);
  }
  draw() {
    if (!this.canvas.clientWidth) return;
    this.setTime();
    this.fit();
    this.axes();
    if (this.data.d === 1) this.timeAxis();
    this.keepInFrame(12);
    if (this.data.d === 1) this.drawLine(); else this.drawSpace();
    this.drawNumbers();
    this.pen.restore();
    this.drawChosen();
  }
  timeAxis() {
    const { times } = this.data, { left, right, wide, frame } = this.view, [first, last] = [times[0], times[times.length - 1]];
    this.pen.fillStyle = this.colour("quiet");
    this.acrossTicks(first, last, time => left + (time - first) / (last - first) * (right - left), 110);
    this.pen.textAlign = "right";
    this.pen.fillText("time", wide - 16, frame[3] + 31);
    this.pen.textAlign = "left";
    this.pen.fillText("position", 8, 14);
  }
  // The picture, each triangle of whose mesh is an affine map of it.
  drawImage() {
    const { grid, image: [left, top, right, bottom], mesh: [columns, rows, step] } = this.data;
    const { naturalWidth: width, naturalHeight: height } = this.image, now = this.placesOf(grid);
    if (!width) return;
    const corner = (column, row) => {
      const [u, v] = [column / (columns - 1), row * step / (rows - 1)];
      return { from: [width * (left + u * (right - left)), height * (top + v * (bottom - top))],
        to: this.pixel(now, column * rows + row * step) };
    };
    // On a sheet of its own: where its triangles overlap they would show, were each transparent.
    this.sheet ??= document.createElement("canvas");
    [this.sheet.width, this.sheet.height] = [this.canvas.width, this.canvas.height];
    const pen = this.sheet.getContext("2d");
    pen.setTransform(this.pen.getTransform());
    for (let i = 0; i + 1 < columns; ++i)
      for (let j = 0; (j + 1) * step < rows; ++j) {
        const [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1)];
        this.drawTriangle(pen, a, b, c);
        this.drawTriangle(pen, d, b, c);
      }
    this.keepInFrame();
    this.pen.globalAlpha = 0.6;
    this.pen.drawImage(this.sheet, 0, 0, this.view.wide, this.view.high);
    this.pen.restore();
  }
  drawTriangle(pen, a, b, c) {
    const minus = (p, q) => [p[0] - q[0], p[1] - q[1]];
    const [u, v] = [minus(b.from, a.from), minus(c.from, a.from)], [x, y] = [minus(b.to, a.to), minus(c.to, a.to)];
    const area = u[0] * v[1] - u[1] * v[0];
    if (!area) return;
    const along = [0, 1].map(k => (x[k] * v[1] - y[k] * u[1]) / area);
    const across = [0, 1].map(k => (y[k] * u[0] - x[k] * v[0]) / area);
    // A little larger, so that no seams are seen.
    const middle = [0, 1].map(k => (a.to[k] + b.to[k] + c.to[k]) / 3);
    pen.save();
    pen.beginPath();
    for (const { to } of [a, b, c]) {
      const off = minus(to, middle), length = Math.hypot(...off) || 1;
      pen.lineTo(to[0] + off[0] / length * 0.7, to[1] + off[1] / length * 0.7);
    }
    pen.clip();
    pen.transform(...along, ...across, a.to[0] - along[0] * a.from[0] - across[0] * a.from[1],
      a.to[1] - along[1] * a.from[0] - across[1] * a.from[1]);
    pen.drawImage(this.image, 0, 0);
    pen.restore();
  }
  // Pixels of place i, and towards the viewer.
  seen(places, i) {
    const { size } = this.data, [x, y, z] = [0, 1, 2].map(c => places[3 * i + c] - size[c] / 2);
    const into = y * Math.cos(this.yaw) - x * Math.sin(this.yaw);
    return [...this.pixel(places, i), this.view.scale * (z * Math.sin(this.pitch) - into * Math.cos(this.pitch))];
  }
  // The marked landmarks that a triangle lies before, by more than those may be below the surface.
  hideBehind(faces, now) {
    const { marked } = this.data, least = 0.02 * Math.hypot(this.view.wide, this.view.high);
    if (faces.length * marked.length > 4e6) return; // a frame must not take long
    const open = new Map(marked.map(a => [a, this.seen(now, a)]));
    for (const [, [a, b, c]] of faces)
      for (const [k, [x, y, near]] of open) {
        if (x < Math.min(a[0], b[0], c[0]) || x > Math.max(a[0], b[0], c[0])) continue;
        const area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        const v = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / area;
        const w = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / area;
        if (v >= 0 && w >= 0 && v + w <= 1 && a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2]) > near + least) {
          this.behind.add(k);
          open.delete(k);
        }
      }
  }
  // The triangles of the surface, the farthest first.
  drawSurface(now) {
    const { triangles, surface, surfaceTimes: times } = this.data, { pen } = this;
    let k = 0;
    while (k + 2 < times.length && times[k + 1] <= this.now.time) ++k;
    const part = (this.now.time - times[k]) / (times[k + 1] - times[k]);
    const places = surface[k].map((place, i) => place + part * (surface[k + 1][i] - place));
    const seen = Array.from({ length: places.length / 3 }, (_, i) => this.seen(places, i));
    const faces = [];
    for (let i = 0; i < triangles.length; i += 3) {
      const corners = [0, 1, 2].map(c => seen[triangles[i + c]]);
      faces.push([corners[0][2] + corners[1][2] + corners[2][2], corners]);
    }
    faces.sort((a, b) => a[0] - b[0]);
    this.hideBehind(faces, now);
    const [darkest, lightest] = matchMedia("(prefers-color-scheme: dark)").matches ? [52, 150] : [150, 246];
    pen.lineWidth = 0.7;
    for (const [, [a, b, c]] of faces) {
      const [u, v] = [[b[0] - a[0], a[1] - b[1], b[2] - a[2]], [c[0] - a[0], a[1] - c[1], c[2] - a[2]]];
      const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      // Light from the upper left; either side of a triangle may be the outer one.
      const lit = (normal[0] * -0.4 + normal[1] * 0.54 + normal[2] * 0.74) / (Math.hypot(...normal) || 1);
      const grey = Math.round(darkest + (lightest - darkest) * Math.max(0, normal[2] < 0 ? -lit : lit));
      pen.fillStyle = pen.strokeStyle = `rgb(${grey},${grey},${grey + 4})`;
      pen.beginPath();
      pen.moveTo(a[0], a[1]);
      pen.lineTo(b[0], b[1]);
      pen.lineTo(c[0], c[1]);
      pen.closePath();
      pen.fill();
      pen.stroke();
    }
  }
  // d = 2 and 3
  drawSpace() {
    const { d, frames, target, groups, outlines, marked, traced, outliers, lines, grid, pairs } = this.data;
    const now = this.placesOf(frames), ink = this.colour("quiet"), goal = this.colour("goal");
    const colours = this.groupColours(), colourOf = a => colours[groups[a] % colours.length];
    const radius = marked.length > 800 ? 1.6 : marked.length > 150 ? 2.6 : 4;
    const has = a => target[d * a] !== null && target[d * a + d - 1] !== null;
    if (this.data.image && this.shows("image")) this.drawImage();
    this.behind = new Set();
    if (this.data.triangles.length && this.shows("surface")) this.drawSurface(now);
    if (grid.length && this.shows("grid")) {
      const places = this.placesOf(grid), colour = this.colour("grid");
      let first = 0;
      this.keepInFrame();
      for (const count of lines) {
        this.path(Array.from({ length: count }, (_, i) => this.pixel(places, first + i)), colour, 1);
        first += count;
      }
      this.pen.restore();
    }
    this.halo = this.data.image && this.shows("image") ? this.colour("surface") : null;
    const outline = (places, list, colour, width, opacity) => {
      for (const members of list)
        this.path(members.map(a => this.pixel(places, a)), colour(members[0]), width, opacity);
    };
    if (this.shows("others")) this.drawOthers(colourOf);
    if (this.shows("source")) {
      outline(frames[0], outlines, () => ink, 1.2, 0.5);
      for (const a of marked) this.dot(this.pixel(frames[0], a), 0.75 * radius, ink, 0.5);
    }
    if (this.shows("extra"))
      for (const line of this.data.extra)
        this.path(Array.from({ length: line.length / d }, (_, i) => this.pixel(line, i)), goal, 1.3, 0.85);
    if (target.length && this.shows("target")) {
      outline(target, (pairs ? outlines : this.data.targetOutlines).map(all => all.filter(has)), () => goal, 1.4, 0.8);
      const rings = pairs ? marked : Array.from({ length: target.length / d }, (_, a) => a);
      for (const a of rings) if (has(a)) this.dot(this.pixel(target, a), radius + 2, goal, 0.9, true);
    }
    for (const a of this.shows("paths") ? traced : []) {
      const trail = frames.slice(0, this.now.k + 1).map(places => this.pixel(places, a));
      this.path([...trail, this.pixel(now, a)], colourOf(a), 1.2, 0.45);
    }
    if (this.shows("landmarks")) {
      outline(now, outlines, colourOf, 1.8, 1);
      for (const a of marked) this.dot(this.pixel(now, a), radius, colourOf(a), this.behind.has(a) ? 0.25 : 1);
    }
    for (const a of this.shows("outliers") ? outliers : []) this.triangle(this.pixel(now, a));
    this.halo = null;
  }
  // Other paths up to now, faintly, and where they are.
  drawOthers(colourOf) {
    const { frames, others, traced } = this.data, opacity = Math.max(0.1, Math.min(0.25, 2 / (others.length || 1)));
    for (const path of others) {
      const now = this.placesOf(path);
      for (const a of traced) {
        const trail = path.slice(0, this.now.k + 1).map(places => this.pixel(places, a));
        this.path([...trail, this.pixel(now, a)], colourOf(a), 1, opacity);
        if (frames[0].length < 400) this.dot(this.pixel(now, a), 1.6, colourOf(a), 2 * opacity);
      }
    }
  }
  drawNumbers() {
    if (!this.layers.get("numbers")?.checked) return;
    const now = this.placesOf(this.data.frames), { pen } = this;
    pen.textAlign = "left";
    pen.lineWidth = 3;
    for (const a of this.data.d === 1 ? this.data.numbers.keys() : this.data.marked) {
      const [x, y] = this.placeNow(a, now), text = String(this.data.names[a] || this.data.numbers[a]);
      pen.strokeStyle = this.colour("surface");
      pen.strokeText(text, x + 6, y - 5);
      pen.fillStyle = this.colour("ink");
      pen.fillText(text, x + 6, y - 5);
    }
  }
  // d = 1: time to the right, place upwards.
  drawLine() {
    const { times, frames, target, grid, groups, outliers } = this.data;
    const { scale, left, bottom, right, frame } = this.view, last = times.length - 1;
    const across = time => left + (time - times[0]) / (times[last] - times[0]) * (right - left);
    const at = (time, place) => [across(time), bottom - scale * place];
    const several = groups.some(g => g !== groups[0]), colours = this.groupColours();
    const colour = a => colours[(several ? groups[a] : a) % colours.length];
    const count = grid.length && this.shows("grid") ? grid[0].length : 0;
    for (let m = 0; m < count; ++m)
      this.path(grid.map((places, k) => at(times[k], places[m])), this.colour("grid"), 1);
    const now = this.placesOf(frames), many = now.length > 60;
    for (const path of this.shows("others") ? this.data.others : [])
      for (let a = 0; a < now.length; ++a)
        this.path(path.map((places, k) => at(times[k], places[a])), colour(a), 1, 0.2);
    for (let a = 0; a < now.length; ++a) {
      const path = frames.map((places, k) => at(times[k], places[a])), there = at(this.now.time, now[a]);
      if (this.shows("paths")) {
        this.path(path, colour(a), 1.2, 0.35);
        this.path([...path.slice(0, this.now.k + 1), there], colour(a), many ? 1 : 2);
      }
      if (this.shows("source")) this.dot(path[0], many ? 2 : 3, this.colour("quiet"), 0.6);
      if (target[a] != null && this.shows("target"))
        this.dot(at(times[last], target[a]), many ? 3 : 6, this.colour("goal"), 1, true);
      if (this.shows("landmarks")) this.dot(there, many ? 2.2 : 4, colour(a));
    }
    this.path([[across(this.now.time), frame[1]], [across(this.now.time), frame[3]]], this.colour("focus"), 1, 0.8);
    for (const a of this.shows("outliers") ? outliers : []) this.triangle(at(this.now.time, now[a]));
  }
}
for (const figure of document.querySelectorAll("figure.motion:not(.space)")) new Motion(figure);
