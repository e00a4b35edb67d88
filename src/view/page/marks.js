// The SVG over a picture: landmarks, wireframe, ellipses, the proposal, the keyboard's cross.

import { ellipseAxes, toScreen } from "./geometry.js";

const kSvg = "http://www.w3.org/2000/svg";
// Okabe and Ito's colours, which differ for all eyes; white rings keep them apart from any photograph.
const kColours = ["#56b4e9", "#e69f00", "#009e73", "#f0e442", "#cc79a7", "#d55e00", "#0072b2", "#9a9a9a"];

export const colourOf = (document, k) => {
  const groups = [...new Set(document.landmarks.map(({ group }) => group))];
  return kColours[Math.max(0, groups.indexOf(document.landmarks[k]?.group ?? "")) % kColours.length];
};

const node = (name, attributes = {}, ...children) => {
  const made = document.createElementNS(kSvg, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
};

const line = (a, b, kind) => node("line", { x1: a[0], y1: a[1], x2: b[0], y2: b[1], class: kind });

const ellipse = (view, shape, kind) => {
  const [cx, cy] = toScreen(view, [shape.x, shape.y]), { rx, ry, angle } = ellipseAxes(shape);
  const sizes = { cx, cy, rx: Math.max(3, view.scale * rx), ry: Math.max(3, view.scale * ry),
    transform: `rotate(${angle} ${cx} ${cy})` };
  return [node("ellipse", { ...sizes, class: "ellipse-under" }), node("ellipse", { ...sizes, class: `ellipse ${kind}` })];
};

const cross = ([x, y], size, kind) => {
  const lines = ["under", "over"].flatMap(layer =>
    [line([x - size, y], [x + size, y], layer), line([x, y - size], [x, y + size], layer)]);
  return node("g", { class: kind }, ...lines);
};

const mark = ([x, y], label, colour, { chosen, doubtful, small }) => {
  const r = small ? 3.2 : chosen ? 7.5 : 5.5;
  const made = node("g", { class: `mark${chosen ? " chosen" : ""}${doubtful ? " doubtful" : ""}` });
  made.style.setProperty("--c", colour);
  made.append(node("circle", { cx: x, cy: y, r, class: "halo" }), node("circle", { cx: x, cy: y, r, class: "ring" }),
    node("circle", { cx: x, cy: y, r: 1.2, class: "dot" }));
  if (doubtful) made.append(node("path", { d: `M${x} ${y - r - 13}l6 10h-12z`, class: "warn" }));
  if (label) made.append(node("text", { x: x + r + 4, y: y - r + 1 }, label));
  return made;
};

// `scene`: {points, labels, colours, links, chosen, doubtful: Map, proposal, cross, draft}, in pixels of the picture.
export const drawMarks = (svg, view, scene) => {
  const parts = [], at = point => toScreen(view, point);
  for (const [a, b] of scene.links) {
    if (!Array.isArray(scene.points[a]) || !Array.isArray(scene.points[b])) continue;
    parts.push(line(at(scene.points[a]), at(scene.points[b]), "link"),
      line(at(scene.points[a]), at(scene.points[b]), "link top"));
  }
  const shape = scene.doubtful.get(scene.chosen);
  if (shape && Array.isArray(scene.points[scene.chosen])) parts.push(...ellipse(view, shape, "amber"));
  const many = scene.points.length > 60;
  scene.points.forEach((point, k) => {
    if (!Array.isArray(point)) return;
    const chosen = k === scene.chosen, doubtful = scene.doubtful.has(k);
    parts.push(mark(at(point), many && !chosen && !doubtful ? "" : scene.labels[k], scene.colours[k],
      { chosen, doubtful, small: many && !chosen }));
  });
  if (scene.proposal) {
    parts.push(...ellipse(view, scene.proposal, ""));
    const ghost = cross(at([scene.proposal.x, scene.proposal.y]), 9, "ghost");
    const [x, y] = at([scene.proposal.x, scene.proposal.y]);
    ghost.append(node("text", { x: x + 12, y: y - 8 }, `${scene.proposal.label}?`));
    parts.push(ghost);
  }
  if (scene.draft.length) {
    const path = scene.draft.map(point => at(point).join(" ")).join(" ");
    parts.push(node("polyline", { points: path, class: "draft" }));
    parts.push(...scene.draft.map(point => mark(at(point), "", "#ffffff", { small: true })));
  }
  if (scene.cross) parts.push(cross(at(scene.cross), 16, "cross"));
  svg.replaceChildren(...parts);
};
