// What can be done to a document: functions from one to the next. `pass` is "points", or "second" when everything is
// digitised again.

import { rounded, spread } from "./geometry.js";

const replaced = (list, i, value) => list.map((old, k) => k === i ? value : old);

export const isPlaced = point => Array.isArray(point);

// What a specimen has in a pass; nothing is in the second one before it begins.
export const pointsOf = (specimen, pass = "points") => specimen[pass] ?? specimen.points.map(() => null);

const withSpecimen = (document, s, change) =>
  ({ ...document, specimens: replaced(document.specimens, s, change(document.specimens[s])) });

const withPoints = (document, s, pass, change) =>
  withSpecimen(document, s, specimen => ({ ...specimen, [pass]: change(pointsOf(specimen, pass)) }));

export const addLandmarks = (document, names, group = "") => ({
  ...document,
  landmarks: [...document.landmarks, ...names.map(name => ({ name, group }))],
  specimens: document.specimens.map(specimen => ({
    ...specimen,
    points: [...specimen.points, ...names.map(() => null)],
    ...(specimen.second ? { second: [...specimen.second, ...names.map(() => null)] } : {}),
  })),
});

// The landmark that a click on a specimen places: the one at hand, where the specimen lacks it, else the next that it
// lacks; else a new one, which is as many as there are.
export const nextFor = (document, s, current, pass = "points") => {
  const points = pointsOf(document.specimens[s], pass);
  const lacks = k => k < points.length && points[k] === null;
  if (lacks(current)) return current;
  for (let k = current + 1; k < points.length; ++k) if (lacks(k)) return k;
  for (let k = 0; k < current; ++k) if (lacks(k)) return k;
  return points.length;
};

export const place = (document, s, k, where, pass = "points") => {
  const grown = k < document.landmarks.length ? document : addLandmarks(document, [""]);
  return withPoints(grown, s, pass, points => replaced(points, k, rounded(where)));
};

// `value` is null, "missing" or "absent".
export const mark = (document, s, k, value, pass = "points") =>
  k < document.landmarks.length && pointsOf(document.specimens[s], pass)[k] !== value
    ? withPoints(document, s, pass, points => replaced(points, k, value))
    : document;

export const swap = (document, s, a, b, pass = "points") =>
  withPoints(document, s, pass, points => points.map((point, k) => k === a ? points[b] : k === b ? points[a] : point));

export const rename = (document, k, name) =>
  ({ ...document, landmarks: replaced(document.landmarks, k, { ...document.landmarks[k], name }) });

export const regroup = (document, k, group) =>
  ({ ...document, landmarks: replaced(document.landmarks, k, { ...document.landmarks[k], group }) });

// Takes a landmark out of all specimens.
export const removeLandmark = (document, k) => {
  const without = list => list.filter((_, i) => i !== k), moved = i => i > k ? i - 1 : i;
  return {
    ...document,
    landmarks: without(document.landmarks),
    links: document.links.filter(link => !link.includes(k)).map(link => link.map(moved)),
    specimens: document.specimens.map(specimen => ({
      ...specimen,
      points: without(specimen.points),
      ...(specimen.second ? { second: without(specimen.second) } : {}),
    })),
  };
};

// Whether nothing is left of a landmark: it has no name, no curve needs it, and no specimen has it.
export const isForgotten = (document, k) => {
  const { name, group } = document.landmarks[k];
  return !name && !group && document.specimens.every(({ points, second }) => points[k] === null && (second?.[k] ?? null) === null);
};

export const toggleLink = (document, a, b) => {
  if (a === b) return document;
  const same = link => (link[0] === a && link[1] === b) || (link[0] === b && link[1] === a);
  const links = document.links.some(same) ? document.links.filter(link => !same(link)) : [...document.links, [a, b]];
  return { ...document, links };
};

// The curves of a document: the landmarks of each group that is named so, in their order.
export const curvesOf = document => {
  const curves = new Map();
  document.landmarks.forEach(({ group }, k) => {
    if (!/^curve \d+$/.test(group)) return;
    if (!curves.has(group)) curves.set(group, []);
    curves.get(group).push(k);
  });
  return [...curves].map(([group, landmarks]) => ({ group, landmarks }));
};

// Spreads semilandmarks along a line: those of the first curve that the specimen lacks, else of a new one, which is
// joined by links.
export const placeCurve = (document, s, line, count, pass = "points") => {
  const points = pointsOf(document.specimens[s], pass);
  let curve = curvesOf(document).find(({ landmarks }) => landmarks.every(k => points[k] === null));
  let grown = document;
  if (!curve) {
    const first = document.landmarks.length, group = `curve ${curvesOf(document).length + 1}`;
    grown = addLandmarks(document, Array(count).fill(""), group);
    curve = { group, landmarks: Array.from({ length: count }, (_, i) => first + i) };
    grown = { ...grown, links: [...grown.links, ...curve.landmarks.slice(1).map(k => [k - 1, k])] };
  }
  const places = spread(line, curve.landmarks.length).map(rounded);
  return withPoints(grown, s, pass, old => old.map((point, k) => {
    const i = curve.landmarks.indexOf(k);
    return i < 0 ? point : places[i];
  }));
};

// Of each picture what the document has landmarks for, none of them placed.
export const addSpecimens = (document, specimens) => ({
  ...document,
  specimens: [...document.specimens, ...specimens.map(specimen => ({ ...specimen, points: document.landmarks.map(() => null) }))],
});

export const show = (document, side, s) => ({ ...document, shown: replaced(document.shown, side, s) });

// How much of a specimen is done: what is placed, missing or absent counts.
export const progressOf = (document, s, pass = "points") => {
  const points = pointsOf(document.specimens[s], pass);
  return { done: points.filter(point => point !== null).length, all: points.length };
};

export const startSecondPass = document => ({
  ...document,
  specimens: document.specimens.map(specimen =>
    specimen.second ? specimen : { ...specimen, second: specimen.points.map(() => null) }),
});

// Of landmark k the pairs of both passes.
export const repeatsOf = (document, k) =>
  document.specimens.filter(({ points, second }) => second && isPlaced(points[k]) && isPlaced(second[k]))
    .map(({ points, second }) => [points[k], second[k]]);
