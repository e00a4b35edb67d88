// The buttons of the page with their keys, and what it says is to be done next.

import { curvesOf } from "./actions.js";

export const landmarkTools = page => {
  const k = page.current, name = page.label(k), open = page.side >= 0;
  return [
    { text: page.mode === "curve" ? "Finish curve" : "Confirm", key: "Enter", main: true, title: "Take the proposed place, or finish the curve",
      disabled: page.mode === "curve" ? !page.drafts.some(draft => draft.length > 1) : !page.proposal, run: () => page.confirm() },
    { text: "Missing", key: "m", title: `Landmark ${name} cannot be seen on this picture`, disabled: !open, run: () => page.mark("missing") },
    { text: "Absent", key: "a", title: `This specimen does not have landmark ${name}`, disabled: !open, run: () => page.mark("absent") },
    { text: "Clear", key: "Delete", title: `Take landmark ${name} off this picture`, disabled: k >= page.now.landmarks.length, run: () => page.clear() },
    null,
    { text: "Previous", key: ",", title: "Previous landmark", disabled: !page.now.landmarks.length, run: () => page.stepLandmark(-1) },
    { text: "Next", key: ".", title: "Next landmark", disabled: !page.now.landmarks.length, run: () => page.stepLandmark(1) },
    { text: "Doubtful", key: "d", title: "Go to the next doubtful landmark", disabled: !page.judged.doubtful.size, run: () => page.nextDoubtful() },
    null,
    { text: "Curve", key: "c", title: "Click along a curve; Enter spreads semilandmarks on it", pressed: page.mode === "curve", run: () => page.setMode("curve") },
    { text: "Wireframe", key: "w", title: "Click two landmarks to join them, or part them", pressed: page.mode === "link", run: () => page.setMode("link") },
    { text: "Digitise again", key: "r", title: "Hide what was placed and measure your error by doing it again", pressed: page.pass === "second", run: () => page.togglePass() },
  ];
};

export const sessionTools = (page, openHelp) => {
  const { undoes, redoes } = page.history;
  return [
    { text: "Undo", key: "Control+z", title: undoes ? `Undo: ${undoes}` : "Nothing to undo", disabled: !undoes, run: () => page.undo(-1) },
    { text: "Redo", key: "Control+Shift+z", title: redoes ? `Redo: ${redoes}` : "Nothing to redo", disabled: !redoes, run: () => page.undo(1) },
    { text: "Add pictures", key: "o", title: "Choose picture files; they can be dropped onto the page, too", run: () => page.chooser.click() },
    { text: "Export", key: "e", title: "Write the landmarks into a file", run: () => page.export() },
    page.hasReport ? { text: "Report", key: "p", title: "Open the report of these results", run: () => page.openReport() } : null,
    { text: "Keys", key: "?", title: "All keys", run: () => openHelp() },
  ].filter(Boolean);
};

// What is to be done next.
export const hintOf = page => {
  if (!page.specimen(0)) return "Drop two pictures onto this page to begin.";
  if (page.mode === "curve")
    return `Click along the curve on a picture; Enter spreads ${curveCount(page)} semilandmarks on it, the ends among them.`;
  if (page.mode === "link") return page.from >= 0 ? `${page.label(page.from)} to … click another landmark.` : "Click two landmarks to join them.";
  const name = page.label(page.current), again = page.pass === "second" ? "Second pass. " : "";
  if (!page.specimen(1)) return `${again}Click where landmark ${name} is. A second picture can be dropped onto the page.`;
  if (page.proposal) return `${again}Landmark ${name}: press Enter if the cross is right, or click where it is.`;
  const { side } = page;
  if (side < 0) return `${again}Landmark ${name} is chosen. Drag it, or click a free place for the next one.`;
  return `${again}Click where landmark ${name} is on ${page.specimen(side).name}.`;
};

// Semilandmarks of the curve that is drawn next: as many as it has on the other picture.
const curveCount = page => {
  const open = curvesOf(page.now).find(({ landmarks }) => landmarks.every(k => [0, 1].some(side => page.points(side)[k] === null)));
  return open ? open.landmarks.length : page.count;
};

// Messages above the pictures, with what can be done about them.
export const alertsOf = page => {
  const list = [], { what, error } = page.saving;
  if (what === "conflict") list.push({ bad: true, text: "Another window changed this session. Which is to stay?", buttons: [
    { text: "its changes", run: () => page.settle(error, false) }, { text: "those of this window", run: () => page.settle(error, true) }] });
  if (what === "failed") list.push({ bad: true, text: `Not saved: ${error.message}. It is tried again; keep this window open.` });
  if (page.trouble) list.push({ bad: true, text: page.trouble, buttons: [
    { text: "close", run: () => { page.trouble = null; page.refresh(); } }] });
  if (page.judged.exchanged.length) {
    const [a, b] = page.judged.exchanged[0];
    list.push({ text: `${page.label(a)} and ${page.label(b)} look exchanged.`, buttons: [
      { text: "Swap them", key: "x", run: () => page.swap() }] });
  } else if (page.judged.findings.length) list.push({ text: page.judged.findings[0] });
  return list;
};
