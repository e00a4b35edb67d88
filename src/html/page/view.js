// What a motion is drawn with: places, whole numbers of units in a box, are turned into pixels, with axes beside them.
const ticksOf = (low, high, most) => {
  const rough = (high - low) / most, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * ([1, 2, 5].find(factor => factor * power >= rough) ?? 10);
  const ticks = [];
  for (let i = Math.ceil(low / step); i * step <= high && ticks.length < 20; ++i)
    ticks.push(Number((i * step).toPrecision(6)));
  return ticks;
};
const font = "12px system-ui, sans-serif";
class MotionView {
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
    const widths = ticksOf(...this.ends(d - 1), 8).map(tick => this.pen.measureText(String(tick)).width);
    const rim = d === 3 ? 14 : 20 + Math.max(...widths);
    const most = Math.min(640, Math.max(300, 0.75 * innerHeight));
    let high = Math.min(most, d === 1 ? Math.max(240, 0.5 * wide) : d === 2 ? wide : Math.min(540, 0.9 * wide));
    let scale = (high - above - below) / (size[0] || 1), left = rim, bottom = high - below;
    if (d === 3) {
      // As large as the box allows, however it is turned about its upright axis.
      const across = Math.hypot(size[0], size[1]), tilt = Math.max(Math.abs(this.pitch), 0.45);
      const down = size[2] * Math.cos(tilt) + across * Math.sin(tilt);
      scale = Math.min((wide - 2 * rim) / (across || 1), (high - 2 * rim) / (down || 1));
      [left, bottom] = [wide / 2, high / 2];
    } else if (d === 2) {
      scale = Math.min((wide - rim - 16) / (size[0] || 1), (high - above - below) / (size[1] || 1));
      high = Math.min(high, Math.max(140, scale * size[1] + above + below));
      left = (wide + rim - 16 - scale * size[0]) / 2;
      bottom = (high + above - below + scale * size[1]) / 2;
    }
    const right = wide - 16;
    const frame = d === 3 ? [0, 0, wide, high] : d === 2 ? [left, bottom - scale * size[1], left + scale * size[0], bottom]
                                                         : [left, above, right, bottom];
    const { factor, shift: [x, y] } = this.zoom;
    this.view = { wide, high, frame, scale: factor * scale, left: x + factor * left, bottom: y + factor * bottom,
      right: x + factor * right };
    const dense = devicePixelRatio || 1;
    this.canvas.style.height = high + "px";
    this.canvas.width = Math.round(wide * dense);
    this.canvas.height = Math.round(high * dense);
    this.pen.setTransform(dense, 0, 0, dense, 0, 0);
    this.pen.lineJoin = "round";
    this.pen.font = font;
  }
  // On a photograph (`halo`) within an edge of the page's colour, from which all colours of marks stand out.
  path(points, colour, width, opacity = 1) {
    const { pen } = this;
    pen.beginPath();
    points.forEach(([x, y], i) => i ? pen.lineTo(x, y) : pen.moveTo(x, y));
    if (this.halo) {
      pen.globalAlpha = 0.8 * Math.min(1, 1.5 * opacity);
      pen.strokeStyle = this.halo;
      pen.lineWidth = width + 2.4;
      pen.stroke();
    }
    pen.globalAlpha = opacity;
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.stroke();
    pen.globalAlpha = 1;
  }
  dot([x, y], radius, colour, opacity = 1, ring = false) {
    const { pen } = this;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 7);
    if (this.halo) {
      pen.globalAlpha = 0.9;
      pen.strokeStyle = this.halo;
      pen.lineWidth = ring ? 4 : 2.6;
      pen.stroke();
    }
    pen.globalAlpha = opacity;
    pen.lineWidth = 1.6;
    pen[ring ? "strokeStyle" : "fillStyle"] = colour;
    ring ? pen.stroke() : pen.fill();
    pen.globalAlpha = 1;
  }
  triangle([x, y]) {
    const corners = [[x, y - 11], [x + 9.5, y + 6], [x - 9.5, y + 6]];
    this.path([...corners, corners[0], corners[1]], this.colour("fails"), 2);
  }
  // The ends of an axis in length units.
  ends(axis) {
    const { low, unit, size } = this.data;
    return [low[axis], low[axis] + unit * (size[axis] || 1)];
  }
  // Ticks where numbers from `low` to `high` lie between two pixels.
  ticks(low, high, from, to, at, distance) {
    const valueAt = pixel => low + (pixel - at(low)) / (at(high) - at(low)) * (high - low);
    const [first, last] = [valueAt(from), valueAt(to)].sort((a, b) => a - b);
    return ticksOf(Math.max(low, first), Math.min(high, last), Math.abs(to - from) / distance)
      .map(tick => [at(tick), String(tick)]);
  }
  acrossTicks(low, high, at, distance) {
    const [left, , right, bottom] = this.view.frame;
    this.pen.textAlign = "center";
    for (const [x, text] of this.ticks(low, high, left, right, at, distance)) {
      this.path([[x, bottom + 2], [x, bottom + 6]], this.colour("quiet"), 1);
      this.pen.fillText(text, x, bottom + 19);
    }
  }
  upTicks(low, high, at) {
    const [left, top, , bottom] = this.view.frame;
    this.pen.textAlign = "right";
    for (const [y, text] of this.ticks(low, high, bottom, top, at, 60)) {
      this.path([[left - 6, y], [left - 2, y]], this.colour("quiet"), 1);
      this.pen.fillText(text, left - 9, y + 4);
    }
  }
  axes() {
    const { d, low, unit } = this.data, { scale, left, bottom } = this.view, { pen } = this;
    pen.fillStyle = this.colour("quiet");
    if (d === 3) return this.box();
    const inUnits = (axis, value) => (value - low[axis]) / unit;
    if (d === 2) this.acrossTicks(...this.ends(0), x => left + scale * inUnits(0, x), 90);
    this.upTicks(...this.ends(d - 1),
      y => d === 2 ? this.height(inUnits(1, y)) : bottom - scale * inUnits(0, y));
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
  // Until restore(): what is zoomed, folded or stretched would run through the numbers of the axes.
  keepInFrame(rim = 1) {
    const [left, top, right, bottom] = this.view.frame;
    this.pen.save();
    this.pen.beginPath();
    this.pen.rect(left - rim, top - rim, right - left + 2 * rim, bottom - top + 2 * rim);
    this.pen.clip();
  }
}
