// What a key does: that of the picture with the focus, else a button's, else one that has no button.

export const runKey = (page, event) => {
  if (document.querySelector("dialog[open]")) return;
  const isText = event.target.matches?.("input[type=text], input[type=number], select");
  const key = `${event.ctrlKey || event.metaKey ? "Control+" : ""}${event.shiftKey && event.key.length > 1 ? "Shift+" : ""}`;
  const name = (event.ctrlKey || event.metaKey) && event.key.length === 1
    ? `Control+${event.shiftKey ? "Shift+" : ""}${event.key.toLowerCase()}` : key + event.key;
  if (isText) {
    if (event.key === "Enter" || event.key === "Escape") event.target.blur();
    return;
  }
  const photo = page.photos.find(({ stage }) => stage === document.activeElement);
  if (photo?.key(event)) return event.preventDefault();
  if (event.target.matches?.("button, input") && ["Enter", " "].includes(event.key)) return;
  const near = photo ?? page.photos[page.handSide];
  const run = {
    "Control+y": () => page.undo(1), "+": () => near.zoom(1.5), "-": () => near.zoom(1 / 1.5), 0: () => near.fit(),
    "[": () => page.stepSpecimen(-1), "]": () => page.stepSpecimen(1), x: () => page.swap(), Backspace: () => page.clear(),
    Escape: () => { if (page.mode !== "place") page.setMode(page.mode); },
    ...Object.fromEntries(page.tools().filter(tool => !tool.disabled).map(tool => [tool.key, tool.run])),
  }[name];
  if (!run) return;
  event.preventDefault();
  run();
};
