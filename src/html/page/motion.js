// Landmarks that move. Places are whole numbers of units in a box; the view turns them into pixels.
const ticksOf = (low, high, most) => {
  const rough = (high - low) / most, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * ([1, 2, 5].find(factor => factor * power >= rough) ?? 10);
  const ticks = [];
  for (let i = Math.ceil(low / step); i * step <= high && ticks.length < 20; ++i)
    ticks.push(Number((i * step).toPrecision(6)));
  return ticks;
};
const font = "12px system-ui, sans-serif";
class Motion {
  constructor(figure) {
    this.figure = figure;
    this.canvas = figure.querySelector("canvas");
    this.slider = figure.querySelector("input");
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
      turn(...steps[event.key]);
    });
    this.canvas.addEventListener("pointerdown", event => this.canvas.setPointerCapture(event.pointerId));
    this.canvas.addEventListener("pointermove", event => {
      if (event.buttons) turn(event.movementX * 0.01, event.movementY * 0.01);
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
    const text = cells.length ? cells.map((cell, i) => this.heads[i] + " " + cell).join(" · ")
                              : "landmark " + this.data.numbers[a];
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
  colour(name) { return getComputedStyle(this.figure).getPropertyValue("--" + name).trim(); }
  groupColours() { return this.colour("groups").split(" "); }
  // Of a coordinate y in the plane, which counts downwards in images.
  height(y) { return this.view.bottom - this.view.scale * (this.data.down ? this.data.size[1] - y : y); }
  // Pixels of place i.
  pixel(places, i) {
    const { d } = this.data, { scale, left, bottom } = this.view;
    if (d === 2) return [left + scale * places[2 * i], this.height(places[2 * i + 1])];
    const [x, y, z] = [0, 1, 2].map(c => places[3 * i + c] - this.data.size[c] / 2);
    const across = x * Math.cos(this.yaw) + y * Math.sin(this.yaw);
    const into = y * Math.cos(this.yaw) - x * Math.sin(this.yaw);
    const up = z * Math.cos(this.pitch) + into * Math.sin(this.pitch);
    return [left + scale * across, bottom - scale * up];
  }
  fit() {
    const { d, size } = this.data, wide = this.canvas.clientWidth, below = 34, above = 20;
    this.pen = this.canvas.getContext("2d");
    this.pen.font = font;
    // Room for the numbers at the left.
    const widths = this.axis(d - 1, unit => unit, 8).map(([, text]) => this.pen.measureText(text).width);
    const rim = d === 3 ? 14 : 20 + Math.max(...widths);
    const most = Math.min(640, Math.max(300, 0.75 * innerHeight));
    let high = Math.min(most, d === 1 ? Math.max(240, 0.5 * wide) : d === 2 ? wide : Math.min(540, 0.9 * wide));
    let scale = (high - above - below) / (size[0] || 1), left = rim, bottom = high - below;
    if (d === 3) {
      scale = (Math.min(wide, high) / 2 - rim) / (Math.hypot(...size) / 2 || 1);
      [left, bottom] = [wide / 2, high / 2];
    } else if (d === 2) {
      scale = Math.min((wide - rim - 16) / (size[0] || 1), (high - above - below) / (size[1] || 1));
      high = Math.min(high, Math.max(140, scale * size[1] + above + below));
      left = (wide + rim - 16 - scale * size[0]) / 2;
      bottom = (high + above - below + scale * size[1]) / 2;
    }
    this.view = { wide, high, scale, left, bottom, right: wide - 16 };
    const dense = devicePixelRatio || 1;
    this.canvas.style.height = high + "px";
    this.canvas.width = Math.round(wide * dense);
    this.canvas.height = Math.round(high * dense);
    this.pen.setTransform(dense, 0, 0, dense, 0, 0);
    this.pen.lineJoin = "round";
    this.pen.font = font;
  }
  path(points, colour, width, opacity = 1) {
    const { pen } = this;
    pen.globalAlpha = opacity;
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    points.forEach(([x, y], i) => i ? pen.lineTo(x, y) : pen.moveTo(x, y));
    pen.stroke();
    pen.globalAlpha = 1;
  }
  dot([x, y], radius, colour, opacity = 1, ring = false) {
    const { pen } = this;
    pen.globalAlpha = opacity;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 7);
    pen.lineWidth = 1.6;
    pen[ring ? "strokeStyle" : "fillStyle"] = colour;
    ring ? pen.stroke() : pen.fill();
    pen.globalAlpha = 1;
  }
  triangle([x, y]) {
    const corners = [[x, y - 11], [x + 9.5, y + 6], [x - 9.5, y + 6]];
    this.path([...corners, corners[0], corners[1]], this.colour("fails"), 2);
  }
  // One scale in length units; `toPixel` of a number of units.
  axis(axis, toPixel, most) {
    const { low, unit, size } = this.data;
    return ticksOf(low[axis], low[axis] + unit * (size[axis] || 1), most)
      .map(tick => [toPixel((tick - low[axis]) / unit), String(tick)]);
  }
  acrossTicks(ticks, y) {
    this.pen.textAlign = "center";
    for (const [x, text] of ticks) {
      this.path([[x, y + 2], [x, y + 6]], this.colour("quiet"), 1);
      this.pen.fillText(text, x, y + 19);
    }
  }
  upTicks(ticks, x) {
    this.pen.textAlign = "right";
    for (const [y, text] of ticks) {
      this.path([[x - 6, y], [x - 2, y]], this.colour("quiet"), 1);
      this.pen.fillText(text, x - 9, y + 4);
    }
  }
  axes() {
    const { d, size } = this.data, { scale, left, bottom, wide, high } = this.view, { pen } = this;
    pen.fillStyle = this.colour("quiet");
    if (d === 3) return this.box();
    if (d === 2) this.acrossTicks(this.axis(0, u => left + scale * u, wide / 90), bottom);
    this.upTicks(this.axis(d - 1, u => d === 2 ? this.height(u) : bottom - scale * u, high / 60), left);
  }
  box() {
    const corner = i => this.pixel([0, 1, 2].map(c => (i >> c & 1) * this.data.size[c]), 0);
    for (let i = 0; i < 8; ++i)
      for (const bit of [1, 2, 4])
        if (!(i & bit)) this.path([corner(i), corner(i | bit)], this.colour("grid"), 1);
    this.pen.textAlign = "center";
    ["x", "y", "z"].forEach((name, c) => {
      const [from, to] = [corner(0), corner(1 << c)];
      this.pen.fillText(name, from[0] + 0.5 * (to[0] - from[0]) - 8, from[1] + 0.5 * (to[1] - from[1]) + 12);
    });
  }
  draw() {
    if (!this.canvas.clientWidth) return;
    this.setTime();
    this.fit();
    this.axes();
    if (this.data.d === 1) this.drawLine(); else this.drawSpace();
    this.drawChosen();
  }
  // Until restore(): a folded or stretched grid would run through the numbers of the axes.
  keepInBox() {
    const { size } = this.data, { scale, left, bottom } = this.view;
    this.pen.save();
    this.pen.beginPath();
    this.pen.rect(left - 1, bottom - scale * size[1] - 1, scale * size[0] + 2, scale * size[1] + 2);
    this.pen.clip();
  }
  // The picture, each triangle of whose mesh is an affine map of it.
  drawImage() {
    const { grid, image: [left, low, right, high], mesh: [columns, rows, step], down } = this.data;
    if (!this.image.naturalWidth) return;
    const width = this.image.naturalWidth / (right - left), height = this.image.naturalHeight / (high - low);
    const now = this.placesOf(grid), first = grid[0];
    const corner = (column, row) => {
      const i = column * rows + row * step, y = first[2 * i + 1];
      return { from: [width * (first[2 * i] - left), height * (down ? y - low : high - y)], to: this.pixel(now, i) };
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
    this.keepInBox();
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
  // d = 2 and 3
  drawSpace() {
    const { d, frames, target, groups, outlines, marked, traced, outliers, lines, grid, pairs } = this.data;
    const now = this.placesOf(frames), ink = this.colour("quiet"), goal = this.colour("goal");
    const colours = this.groupColours(), colourOf = a => colours[groups[a] % colours.length];
    const radius = marked.length > 800 ? 1.6 : marked.length > 150 ? 2.6 : 4;
    const has = a => target[d * a] !== null && target[d * a + d - 1] !== null;
    if (this.data.image) this.drawImage();
    if (grid.length) {
      const places = this.placesOf(grid), colour = this.colour("grid");
      let first = 0;
      this.keepInBox();
      for (const count of lines) {
        this.path(Array.from({ length: count }, (_, i) => this.pixel(places, first + i)), colour, 1);
        first += count;
      }
      this.pen.restore();
    }
    const outline = (places, list, colour, width, opacity) => {
      for (const members of list)
        this.path(members.map(a => this.pixel(places, a)), colour(members[0]), width, opacity);
    };
    outline(frames[0], outlines, () => ink, 1.2, 0.5);
    for (const a of marked) this.dot(this.pixel(frames[0], a), 0.75 * radius, ink, 0.5);
    if (target.length) {
      outline(target, (pairs ? outlines : this.data.targetOutlines).map(all => all.filter(has)), () => goal, 1.4, 0.8);
      const rings = pairs ? marked : Array.from({ length: target.length / d }, (_, a) => a);
      for (const a of rings) if (has(a)) this.dot(this.pixel(target, a), radius + 2, goal, 0.9, true);
    }
    for (const a of traced) {
      const trail = frames.slice(0, this.now.k + 1).map(places => this.pixel(places, a));
      this.path([...trail, this.pixel(now, a)], colourOf(a), 1.2, 0.45);
    }
    outline(now, outlines, colourOf, 1.8, 1);
    for (const a of marked) this.dot(this.pixel(now, a), radius, colourOf(a));
    for (const a of outliers) this.triangle(this.pixel(now, a));
  }
  // d = 1: time to the right, place upwards.
  drawLine() {
    const { times, frames, target, grid, groups, outliers } = this.data;
    const { scale, left, bottom, right, wide } = this.view, last = times.length - 1;
    const across = time => left + (time - times[0]) / (times[last] - times[0]) * (right - left);
    const at = (time, place) => [across(time), bottom - scale * place];
    const several = groups.some(g => g !== groups[0]), colours = this.groupColours();
    const colour = a => colours[(several ? groups[a] : a) % colours.length];
    this.pen.fillStyle = this.colour("quiet");
    this.acrossTicks(ticksOf(times[0], times[last], wide / 110).map(time => [across(time), String(time)]), bottom);
    this.pen.textAlign = "right";
    this.pen.fillText("time", right, bottom + 31);
    this.pen.textAlign = "left";
    this.pen.fillText("position", 8, 14);
    const count = grid.length ? grid[0].length : 0;
    for (let m = 0; m < count; ++m)
      this.path(grid.map((places, k) => at(times[k], places[m])), this.colour("grid"), 1);
    const now = this.placesOf(frames);
    for (let a = 0; a < now.length; ++a) {
      const path = frames.map((places, k) => at(times[k], places[a])), there = at(this.now.time, now[a]);
      this.path(path, colour(a), 1.2, 0.35);
      this.path([...path.slice(0, this.now.k + 1), there], colour(a), 2);
      this.dot(path[0], 3, this.colour("quiet"), 0.6);
      if (target[a] != null) this.dot(at(times[last], target[a]), 6, this.colour("goal"), 1, true);
      this.dot(there, 4, colour(a));
    }
    this.path([[across(this.now.time), 20], [across(this.now.time), bottom]], this.colour("focus"), 1, 0.8);
    for (const a of outliers) this.triangle(at(this.now.time, now[a]));
  }
}
for (const figure of document.querySelectorAll("figure.motion")) new Motion(figure);
