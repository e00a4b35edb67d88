// What is beside the pictures: buttons, the list of landmarks, messages, specimens, the strip, the dialogs.

import * as actions from "./actions.js";
import { repeatError } from "./geometry.js";
import { colourOf } from "./marks.js";
import { element } from "./result.js";

// Every action: its key, what the button says, what it does, and whether it can be done now.
export const keyName = key => key.replace("Control+", "Ctrl ").replace("Shift+", "⇧ ").replace("Delete", "Del");

// Fills a button anew: one that is replaced between the press and the release of the mouse would not be clicked.
const setTool = (made, { key, text, title, main, pressed, disabled, run }) => {
  made.className = main ? "main" : "";
  made.title = title ?? "";
  made.disabled = Boolean(disabled);
  if (pressed !== undefined) made.setAttribute("aria-pressed", String(pressed));
  if (key) made.setAttribute("aria-keyshortcuts", key);
  made.onclick = run;
  if (made.dataset.text === text) return;
  made.dataset.text = text;
  made.replaceChildren(text, key ? element("kbd", {}, keyName(key)) : "");
};

export const toolButton = tool => {
  const made = element("button", { type: "button" });
  setTool(made, tool);
  return made;
};

// `more` are further elements behind the buttons.
export const fillTools = (root, tools, more = []) => {
  const made = root.made ?? tools.map(tool => tool ? element("button", { type: "button" }) : element("span", { class: "gap" }));
  if (!root.made) root.prepend(...made);
  root.made = made;
  tools.forEach((tool, i) => tool && setTool(made[i], tool));
  for (const old of [...root.children].slice(made.length)) if (!more.includes(old)) old.remove();
  for (const one of more) if (one.parentNode !== root) root.append(one);
};

const stateText = (points, side) => {
  const point = points[side];
  if (point === undefined || point === null) return "–";
  return Array.isArray(point) ? "●" : point;
};

const spoken = point => Array.isArray(point) ? "placed" : point ?? "not placed";

export class LandmarkList {
  constructor(root, count, on) {
    Object.assign(this, { root, count, on, rows: [] });
  }

  show(document, { chosen, pass, doubtful, noiseShare, residuals }) {
    const [left, right] = document.shown.map(s => document.specimens[s] && actions.pointsOf(document.specimens[s], pass));
    const pairs = document.landmarks.filter((_, k) => actions.isPlaced(left?.[k]) && actions.isPlaced(right?.[k])).length;
    this.count.textContent = `${pairs} of ${document.landmarks.length} on both`;
    while (this.rows.length > document.landmarks.length) this.rows.pop().row.remove();
    document.landmarks.forEach((landmark, k) => {
      const parts = this.rows[k] ?? this.add(k);
      parts.row.classList.toggle("chosen", k === chosen);
      parts.pick.setAttribute("aria-pressed", String(k === chosen));
      parts.row.style.setProperty("--c", colourOf(document, k));
      if (parts.name !== window.document.activeElement) parts.name.value = landmark.name;
      parts.name.placeholder = landmark.group || "name";
      const error = repeatError(actions.repeatsOf(document, k));
      const share = noiseShare?.get(k);
      const texts = [`${stateText([left?.[k]], 0)} ${stateText([right?.[k]], 0)}`], residual = residuals?.get(k);
      if (residual !== undefined) texts.push(`${residual.toPrecision(2)} px`);
      if (error !== null) texts.push(`σ ${error.toFixed(1)} px`);
      if (share > 0.05) texts.push(`noise ${Math.round(100 * share)} %`);
      if (doubtful.has(k)) texts.push("▲ doubtful");
      parts.state.textContent = texts.join(" · ");
      parts.state.setAttribute("aria-label",
        `left ${spoken(left?.[k])}, right ${spoken(right?.[k])}${residual === undefined ? "" : `, residual ${residual.toPrecision(2)} pixels`}${doubtful.has(k) ? ", doubtful" : ""}`);
      parts.state.setAttribute("role", "img");
      parts.state.classList.toggle("amber", doubtful.has(k));
    });
    if (this.last !== chosen) this.rows[chosen]?.row.scrollIntoView({ block: "nearest" });
    this.last = chosen;
  }

  add(k) {
    const pick = element("button", { type: "button", "aria-label": `Landmark ${k + 1}`, onclick: () => this.on.choose(k) },
      element("span", { class: "bead" }), String(k + 1));
    const name = element("input", { type: "text", "aria-label": `Name of landmark ${k + 1}`, maxlength: 200,
      onchange: event => this.on.rename(k, event.target.value.trim()), onfocus: () => this.on.choose(k) });
    const state = element("span", { class: "state" });
    const row = element("div", { class: "row" }, pick, name, state);
    this.rows[k] = { row, pick, name, state };
    this.root.append(row);
    return this.rows[k];
  }
}

export const showSpecimens = (root, document, pass, on) => {
  const s = document.shown[1], specimen = document.specimens[s];
  const key = JSON.stringify([s, pass, specimen?.name, document.specimens.map((_, i) => actions.progressOf(document, i, pass))]);
  if (root.shownKey === key) return undefined;
  root.shownKey = key;
  if (!specimen) return root.replaceChildren();
  const { done, all } = actions.progressOf(document, s, pass), part = all ? Math.round(100 * done / all) : 0;
  const step = (by, text, label, key) => element("button", { type: "button", "aria-label": label, title: `${label} (${key})`,
    "aria-keyshortcuts": key, disabled: s + by < 1 || s + by >= document.specimens.length, onclick: () => on.step(by) }, text);
  const bar = element("span", { class: "bar", role: "progressbar", "aria-label": "Landmarks done on this specimen",
    "aria-valuemin": 0, "aria-valuemax": 100, "aria-valuenow": part }, element("span"));
  bar.firstChild.style.width = `${part}%`;
  const finished = document.specimens.filter((_, i) => {
    const progress = actions.progressOf(document, i, pass);
    return progress.all > 0 && progress.done === progress.all;
  }).length;
  return root.replaceChildren(step(-1, "‹", "Previous specimen", "["),
    element("span", {}, `${specimen.name}: ${s + 1} of ${document.specimens.length}`), bar,
    element("span", { class: "quiet" }, `${done} of ${all}; ${finished} done`), step(1, "›", "Next specimen", "]"));
};

export const showAlerts = (root, alerts) =>
  root.replaceChildren(...alerts.map(({ text, bad, buttons = [] }) =>
    element("div", { class: bad ? "alert bad" : "alert", role: bad ? "alert" : null }, element("span", {}, text),
      ...buttons.map(toolButton))));

// The landmark magnified on other specimens.
export class Strip {
  constructor(root, bitmapOf) {
    Object.assign(this, { root, bitmapOf });
  }

  show(document, chosen, pass) {
    const most = 12, half = 22;
    const found = document.specimens.map((specimen, s) => ({ specimen, s, point: actions.pointsOf(specimen, pass)[chosen] }))
      .filter(({ s, point, specimen }) => !document.shown.includes(s) && actions.isPlaced(point) && specimen.picture)
      .slice(-most);
    this.root.hidden = found.length === 0;
    const key = JSON.stringify(found.map(({ s, point }) => [s, point]));
    if (key === this.key) return;
    this.key = key;
    this.root.replaceChildren(...found.map(({ specimen, s, point }) => {
      const canvas = element("canvas", { width: 176, height: 176, role: "img",
        "aria-label": `Landmark ${chosen + 1} on ${specimen.name}` });
      this.bitmapOf(s).then(bitmap => {
        const pen = canvas.getContext("2d"), reach = half * Math.max(specimen.width, specimen.height) / 500;
        const by = bitmap.width / specimen.width;
        pen.drawImage(bitmap, by * (point[0] + 0.5 - reach), by * (point[1] + 0.5 - reach), 2 * by * reach, 2 * by * reach,
          0, 0, 176, 176);
        for (const [colour, width] of [["#10141a", 6], ["#ffffff", 2.5]]) {
          pen.strokeStyle = colour;
          pen.lineWidth = width;
          pen.beginPath();
          pen.arc(88, 88, 16, 0, 2 * Math.PI);
          pen.stroke();
        }
      }).catch(() => {});
      return element("span", { class: "cut" }, canvas, element("span", { class: "name" }, specimen.name));
    }));
  }
}

export const openExport = (dialog, proposed, write) => {
  const input = element("input", { type: "text", value: proposed, "aria-label": "Name of the file", spellcheck: "false" });
  const answer = element("div", { role: "status" });
  const go = async event => {
    event.preventDefault();
    answer.replaceChildren("writing …");
    try {
      const done = await write(input.value.trim());
      const parts = [element("p", {}, `${done.file} holds ${done.shapes === 1 ? "one shape" : `${done.shapes} shapes`}.`)];
      if (done.kept) parts.push(element("p", {}, `What it held before is in ${done.kept}.`));
      parts.push(...done.losses.map(text => element("p", { class: "quiet" }, text)));
      if (done.shapes > 1)
        parts.push(element("p", {}, "Go on with it in a terminal:"),
          element("pre", { tabindex: 0 }, `pulson register '${done.file}#1' '${done.file}#2' -o out`));
      answer.replaceChildren(...parts);
    } catch (error) {
      answer.replaceChildren(element("p", { role: "alert" }, error.message));
    }
  };
  dialog.replaceChildren(element("h2", { id: "export-heading" }, "Export landmarks"),
    element("p", {}, "All specimens, into a file beside the session. The extension says the format: .tps, .csv, .json and others."),
    element("form", { onsubmit: go }, element("div", { class: "field" }, input, element("button", { class: "main" }, "Export"))),
    answer, element("button", { type: "button", onclick: () => dialog.close() }, "Close"));
  dialog.showModal();
  input.select();
};

export const openHelp = (dialog, tools) => {
  const rows = [["click", "place the landmark; on a landmark: choose it"], ["drag", "move a landmark; elsewhere: the picture"],
    ["wheel, two fingers, + and −", "zoom"], ["arrow keys", "move the cross on a picture (⇧ finer, Alt further); space places there"],
    ["Tab", "go from picture to picture"],
    ...tools.filter(tool => tool?.key).map(({ key, title }) => [keyName(key), title])];
  dialog.replaceChildren(element("h2", { id: "help-heading" }, "Keys"),
    element("table", {}, element("tbody", {}, ...rows.map(([key, text]) => element("tr", {}, element("td", {}, element("kbd", {}, key)),
      element("td", {}, text))))),
    element("button", { type: "button", onclick: () => dialog.close() }, "Close"));
  dialog.showModal();
};
