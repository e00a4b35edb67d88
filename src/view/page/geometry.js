// Plane geometry of the page, without a browser. A view {scale, x, y} shows the pixel p of a picture, whose centre is at
// (px, py), at scale * (p + 1/2) + (x, y) on the screen.

export const fitView = (width, height, wide, high, margin = 12) => {
  const scale = Math.max(1e-6, Math.min((wide - 2 * margin) / width, (high - 2 * margin) / height));
  return { scale, x: (wide - scale * width) / 2, y: (high - scale * height) / 2 };
};

// Whether two pictures are larger one above the other than side by side.
export const areLargerStacked = (sizes, wide, high) => {
  const scale = (w, h) => Math.min(...sizes.map(([width, height]) => Math.min(w / width, h / height)));
  return scale(wide, high / 2) > 1.1 * scale(wide / 2, high);
};

export const toScreen = (view, [x, y]) => [view.x + view.scale * (x + 0.5), view.y + view.scale * (y + 0.5)];
export const toPicture = (view, [x, y]) => [(x - view.x) / view.scale - 0.5, (y - view.y) / view.scale - 0.5];

// Zooms so that what is at the place of the screen stays there.
export const zoomAt = (view, factor, [x, y], least, most) => {
  const scale = Math.min(most, Math.max(least, view.scale * factor)), by = scale / view.scale;
  return { scale, x: x - by * (x - view.x), y: y - by * (y - view.y) };
};

export const panBy = (view, dx, dy) => ({ ...view, x: view.x + dx, y: view.y + dy });

export const centreOn = (view, place, wide, high) => {
  const [x, y] = toScreen(view, place);
  return panBy(view, wide / 2 - x, high / 2 - y);
};

export const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

// A pixel's hundredth is finer than any click.
export const rounded = ([x, y]) => [Math.round(100 * x) / 100, Math.round(100 * y) / 100];

export const clampTo = (width, height, [x, y]) =>
  [Math.min(width - 0.5, Math.max(-0.5, x)), Math.min(height - 0.5, Math.max(-0.5, y))];

export const isInside = (width, height, [x, y]) => x >= -0.5 && y >= -0.5 && x <= width - 0.5 && y <= height - 0.5;

// Half axes and the angle, in degrees, of {x: (x - c)' M^-1 (x - c) <= 1}, M = [xx xy; xy yy].
export const ellipseAxes = ({ xx, xy, yy }) => {
  const middle = (xx + yy) / 2, apart = Math.hypot((xx - yy) / 2, xy);
  return {
    rx: Math.sqrt(Math.max(0, middle + apart)),
    ry: Math.sqrt(Math.max(0, middle - apart)),
    angle: 90 / Math.PI * Math.atan2(2 * xy, xx - yy),
  };
};

// The place in a list of points (null: none) that is nearest, within the radius; -1: none.
export const nearest = (points, place, radius) => {
  let best = -1, least = radius;
  points.forEach((point, i) => {
    if (!Array.isArray(point)) return;
    const apart = distance(point, place);
    if (apart <= least) [best, least] = [i, apart];
  });
  return best;
};

// Points at equal distances along a line, its ends among them.
export const spread = (line, count) => {
  const lengths = [0];
  for (let i = 1; i < line.length; ++i) lengths.push(lengths[i - 1] + distance(line[i - 1], line[i]));
  const all = lengths[lengths.length - 1], points = [];
  for (let k = 0, i = 1; k < count; ++k) {
    const at = count > 1 ? all * k / (count - 1) : all / 2;
    while (i < line.length - 1 && lengths[i] < at) ++i;
    const part = lengths[i] > lengths[i - 1] ? (at - lengths[i - 1]) / (lengths[i] - lengths[i - 1]) : 0;
    points.push([0, 1].map(c => line[i - 1][c] + part * (line[i][c] - line[i - 1][c])));
  }
  return points;
};

// The standard deviation of a coordinate of one digitising, from pairs of them: of the difference the variance is twice.
export const repeatError = pairs =>
  pairs.length === 0 ? null
    : Math.sqrt(pairs.reduce((sum, [a, b]) => sum + distance(a, b) ** 2, 0) / (4 * pairs.length));
