// The page: brings the document, the two pictures, the judgement and the result together.

import * as actions from "./actions.js";
import * as api from "./api.js";
import * as panels from "./panels.js";
import { areLargerStacked } from "./geometry.js";
import { runKey } from "./keys.js";
import { Photo } from "./photo.js";
import { Result, element } from "./result.js";
import { Saver, takePictures } from "./saving.js";
import { History } from "./state.js";
import { colourOf } from "./marks.js";
import { alertsOf, hintOf, landmarkTools, sessionTools } from "./tools.js";

const byId = id => document.getElementById(id);
const kManyLandmarks = 60; // that are judged only when a drag ends
const kMostBitmaps = 16; // pictures in memory: those shown and those of the strip

class Page {
  constructor({ file, document: state, export: proposedName, report: hasReport }) {
    Object.assign(this, { file, proposedName, hasReport, current: 0, pass: "points", mode: "place", from: -1, drafts: [[], []],
      count: 10, judged: { proposal: null, of: [], doubtful: new Map(), exchanged: [], findings: [] }, bitmaps: new Map(), trouble: null });
    this.history = new History(state);
    this.saver = new Saver(state.revision, api.saveState, (what, error) => this.reportSaving(what, error));
    this.photos = [0, 1].map(side => new Photo(side, {
      place: where => this.place(side, where),
      move: (k, where) => this.move(side, k, where),
      dropped: () => {
        this.history.seal();
        this.refresh();
      },
      choose: k => this.choose(k, side),
      drop: files => this.takePictures(files),
    }));
    byId("photos").append(...this.photos.map(({ root }) => root));
    this.result = new Result(byId("result"), map => this.hearResult(map));
    this.list = new panels.LandmarkList(byId("rows"), byId("count"), {
      choose: k => this.choose(k),
      rename: (k, name) => this.apply(actions.rename(this.now, k, name), "name"),
    });
    this.strip = new panels.Strip(byId("strip"), s => this.bitmapOf(s));
    this.countField = element("label", {}, "semilandmarks ", element("input", { type: "number", min: 3, max: 200, value: this.count,
      onchange: event => { this.count = Math.min(200, Math.max(3, Math.round(Number(event.target.value)) || 10)); this.refresh(); } }));
    this.chooser = element("input", { type: "file", multiple: true, accept: "image/*,.tif,.tiff", onchange: event => {
      this.takePictures([...event.target.files]);
      event.target.value = "";
    } });
    this.history.listen((_, reason) => {
      if (reason !== "reset") this.saver.save(this.now);
      this.refresh();
    });
    addEventListener("keydown", event => runKey(this, event));
    addEventListener("dragover", event => event.preventDefault());
    addEventListener("drop", event => {
      if (event.defaultPrevented) return; // a picture took them
      event.preventDefault();
      if (event.dataTransfer.files.length) this.takePictures([...event.dataTransfer.files]);
    });
    addEventListener("beforeunload", event => { if (!this.saver.isSaved) event.preventDefault(); });
    new ResizeObserver(() => this.arrange()).observe(byId("photos"));
    this.reportSaving("saved");
    this.current = this.firstOpen();
    this.refresh();
  }

  get now() { return this.history.now; }
  specimen(side) { return this.now.specimens[this.now.shown[side]]; }
  points(side) { return this.specimen(side) ? actions.pointsOf(this.specimen(side), this.pass) : []; }
  label(k) { return this.now.landmarks[k]?.name || String(k + 1); }

  apply(next, what, joins = null) { this.history.apply(next, what, joins); }

  firstOpen() {
    const [left, right] = [this.points(0), this.points(1)];
    const open = left.findIndex((point, k) => point === null || right[k] === null);
    return open < 0 ? left.length : open;
  }

  // The proposed place of the landmark at hand; none where the program spoke of another one.
  get proposal() {
    const { proposal, of } = this.judged;
    return proposal && of[0] === this.current && of[1] === this.side ? proposal : null;
  }

  // ---- what is done

  place(side, where) {
    if (!this.specimen(side)) return;
    if (this.mode === "curve") {
      this.drafts[side] = [...this.drafts[side], where];
      this.refresh();
      return;
    }
    const s = this.now.shown[side], k = actions.nextFor(this.now, s, this.current, this.pass);
    this.current = k;
    this.apply(actions.place(this.now, s, k, where, this.pass), `place ${this.label(k)}`);
    this.advance();
  }

  // When the landmark at hand is done on both, the next one.
  advance() {
    const [left, right] = [this.points(0), this.points(1)], k = this.current;
    if ((left[k] ?? null) !== null && (right.length === 0 || (right[k] ?? null) !== null)) this.current = this.firstOpen();
    this.refresh();
  }

  move(side, k, where) {
    this.current = k;
    this.apply(actions.place(this.now, this.now.shown[side], k, where, this.pass), `move ${this.label(k)}`, `move ${side} ${k}`);
  }

  choose(k, side = -1) {
    if (this.mode === "link") {
      if (this.from >= 0 && this.from !== k) this.apply(actions.toggleLink(this.now, this.from, k), "wireframe");
      this.from = this.from === k ? -1 : k;
    }
    this.current = k;
    if (side < 0) [0, 1].forEach(i => Array.isArray(this.points(i)[k]) && this.photos[i].reveal(this.points(i)[k]));
    this.refresh();
  }

  // The side that the landmark at hand is to be placed on.
  get side() {
    const k = this.current;
    if (!this.specimen(1)) return 0;
    return (this.points(0)[k] ?? null) === null ? 0 : (this.points(1)[k] ?? null) === null ? 1 : -1;
  }

  confirm() {
    if (this.mode === "curve") return this.finishCurve();
    const { proposal, side } = this;
    if (!proposal) return;
    this.apply(actions.place(this.now, this.now.shown[side], this.current, [proposal.x, proposal.y], this.pass),
      `confirm ${this.label(this.current)}`);
    this.advance();
  }

  finishCurve() {
    this.drafts.forEach((draft, side) => {
      if (draft.length < 2) return;
      this.apply(actions.placeCurve(this.now, this.now.shown[side], draft, this.count, this.pass), "curve");
    });
    this.drafts = [[], []];
    this.current = this.firstOpen();
    this.refresh();
  }

  // The side that has the focus, else the one that waits.
  get handSide() {
    const focused = this.photos.findIndex(({ stage }) => stage === document.activeElement);
    return focused >= 0 ? focused : this.side >= 0 ? this.side : 1;
  }

  mark(value) {
    const side = this.side >= 0 ? this.side : this.handSide, k = this.current;
    if (!this.specimen(side)) return;
    const grown = k < this.now.landmarks.length ? this.now : actions.addLandmarks(this.now, [""]);
    this.apply(actions.mark(grown, this.now.shown[side], k, value, this.pass), `${value} ${this.label(k)}`);
    this.advance();
  }

  clear() {
    const k = this.current, what = `clear ${this.label(k)}`;
    if (k >= this.now.landmarks.length) return;
    const side = this.points(this.handSide)[k] !== null ? this.handSide : 1 - this.handSide;
    const cleared = this.specimen(side) ? actions.mark(this.now, this.now.shown[side], k, null, this.pass) : this.now;
    this.apply(actions.isForgotten(cleared, k) ? actions.removeLandmark(cleared, k) : cleared, what);
    this.current = Math.min(this.current, this.now.landmarks.length);
    this.refresh();
  }

  swap() {
    const pair = this.judged.exchanged[0];
    if (pair) this.apply(actions.swap(this.now, this.now.shown[1], ...pair, this.pass), "swap");
  }

  nextDoubtful() {
    const all = [...this.judged.doubtful.keys()].sort((a, b) => a - b);
    const next = all.find(k => k > this.current) ?? all[0];
    if (next !== undefined) this.choose(next);
  }

  stepLandmark(by) {
    const count = this.now.landmarks.length;
    if (count) this.choose((this.current + by + count + 1) % (count + 1));
  }

  stepSpecimen(by) {
    const s = this.now.shown[1] + by;
    if (s < 1 || s >= this.now.specimens.length) return;
    this.history.show(actions.show(this.now, 1, s));
    this.current = this.firstOpen();
    this.refresh();
  }

  setMode(mode) {
    this.mode = this.mode === mode ? "place" : mode;
    this.from = -1;
    this.drafts = [[], []];
    this.refresh();
  }

  togglePass() {
    if (this.pass === "points") {
      this.pass = "second";
      this.apply(actions.startSecondPass(this.now), "digitise again");
    } else this.pass = "points";
    this.current = this.firstOpen();
    this.refresh();
  }

  undo(by) {
    if (by > 0 ? this.history.redo() : this.history.undo()) {
      if (this.now.specimens.every(({ second }) => !second)) this.pass = "points";
      this.current = Math.min(this.current, this.now.landmarks.length);
      this.refresh();
    }
  }

  takePictures(files) { return takePictures(this, files); }

  // Until all that was done is in the file.
  async saved() {
    for (let i = 0; !this.saver.isSaved; ++i) {
      if (i > 100) throw new Error("the session is not saved, so nothing more can be done");
      await new Promise(done => setTimeout(done, 50));
    }
  }

  export() {
    panels.openExport(byId("export-dialog"), this.proposedName, async name => {
      await this.saved();
      const done = await api.exportTo(name);
      this.saver.revision = done.document.revision;
      this.proposedName = name;
      return done;
    });
  }

  openReport() { open("report.html", "_blank", "noopener"); }

  // ---- what is shown

  async bitmapOf(s) {
    const { picture } = this.now.specimens[s];
    const found = this.bitmaps.get(picture) ?? api.loadPicture(s);
    this.bitmaps.delete(picture);
    this.bitmaps.set(picture, found); // the last used is last
    if (this.bitmaps.size > kMostBitmaps) this.bitmaps.delete(this.bitmaps.keys().next().value);
    return found;
  }

  reportSaving(what, error = null) {
    const text = { saved: `saved in ${this.file}`, saving: "saving …", failed: "not saved", conflict: "not saved" }[what];
    byId("saved").textContent = text;
    byId("saved").classList.toggle("failed", what === "failed" || what === "conflict");
    this.saving = { what, error };
    this.showAlerts();
  }

  showAlerts() {
    const list = alertsOf(this), key = JSON.stringify(list);
    if (key === this.alertsKey) return;
    this.alertsKey = key;
    panels.showAlerts(byId("alerts"), list);
  }

  settle(error, keepsOwn) {
    const theirs = error.reply.document;
    if (!keepsOwn) this.history.reset(theirs);
    this.saver.resume(theirs.revision, keepsOwn);
    this.refresh();
  }

  // All buttons that have a key.
  tools() { return [...landmarkTools(this), ...sessionTools(this, () => this.openHelp())].filter(tool => tool?.key); }
  openHelp() { panels.openHelp(byId("help-dialog"), this.tools()); }

  refresh() {
    this.refreshing ??= requestAnimationFrame(() => {
      this.refreshing = null;
      this.result.doubtful = this.judged.doubtful;
      if (this.specimen(1)) this.result.update(this.points(0), this.points(1)); // first, so that the program begins
      this.showAll();
      if (!this.result.isQuick) this.askForJudgement(); // else when the map is there, which comes first
    });
  }

  showAll() {
    document.title = `${this.specimen(1)?.name ?? this.specimen(0)?.name ?? "pulson"} – pulson view`;
    this.showPictures();
    panels.fillTools(byId("tools"), landmarkTools(this), this.mode === "curve" ? [this.countField] : []);
    panels.fillTools(byId("session-tools"), sessionTools(this, () => this.openHelp()));
    panels.showSpecimens(byId("specimens"), this.now, this.pass, { step: by => this.stepSpecimen(by) });
    byId("hint").textContent = hintOf(this);
    this.list.show(this.now, { chosen: this.current, pass: this.pass, doubtful: this.judged.doubtful,
      noiseShare: this.noiseShare, residuals: this.residuals });
    this.strip.show(this.now, this.current, this.pass);
    this.showAlerts();
  }

  showPictures() {
    const shownKey = JSON.stringify(this.now.shown.map(s => this.now.specimens[s]?.picture));
    if (shownKey !== this.shownKey) {
      this.shownKey = shownKey;
      this.loadPictures();
    }
    const { landmarks } = this.now, labels = landmarks.map((_, k) => this.label(k));
    const colours = landmarks.map((_, k) => colourOf(this.now, k));
    const { proposal } = this;
    this.photos.forEach((photo, side) => {
      photo.setScene({ points: this.points(side), labels, colours, links: this.now.links, chosen: this.current,
        doubtful: side === 1 ? this.judged.doubtful : new Map(), draft: this.drafts[side],
        awaits: this.side === side && this.mode !== "link",
        proposal: proposal && this.side === side ? { ...proposal, label: this.label(this.current) } : null });
      photo.root.classList.toggle("next", this.side === side && this.mode === "place");
    });
  }

  async loadPictures() {
    const key = this.shownKey, specimens = [0, 1].map(side => this.specimen(side));
    const sizes = specimens.map(specimen => specimen ? [specimen.width, specimen.height] : [4, 3]);
    const bitmaps = await Promise.all(specimens.map((specimen, side) =>
      specimen?.picture ? this.bitmapOf(this.now.shown[side]).catch(error => { this.trouble = error.message; return null; }) : null));
    if (key !== this.shownKey) return;
    this.sizes = sizes;
    this.arrange();
    specimens.forEach((specimen, side) =>
      this.photos[side].setPicture(specimen?.name ?? "no picture yet: drop one here", sizes[side], bitmaps[side]));
    await this.result.setPictures(bitmaps, sizes, specimens.map(specimen => specimen?.name ?? "…"));
    this.result.key = "";
    this.refresh();
  }

  // Wide pictures stand one above the other.
  arrange() {
    const root = byId("photos");
    if (this.sizes) root.classList.toggle("stacked", areLargerStacked(this.sizes, root.clientWidth, root.clientHeight));
  }

  // ---- what the program says

  async askForJudgement() {
    if (!this.specimen(1)) return;
    const side = this.side, wanted = side >= 0 && this.current < this.now.landmarks.length ? this.current : null;
    const [left, right] = [this.points(0), this.points(1)];
    const isBackwards = side === 0; // the left one is proposed by the right one
    const request = isBackwards ? { left: right, right: left, wanted } : { left, right, wanted };
    const key = JSON.stringify(request);
    if (key === this.judgedKey) return;
    // Of many landmarks it takes longer than a step of a drag: at its end.
    if (left.length > kManyLandmarks && this.photos.some(({ gesture }) => gesture?.kind === "drag")) return;
    this.judgedKey = key;
    if (this.judging) {
      this.judgesAgain = true;
      return;
    }
    this.judging = true;
    const begun = performance.now();
    try {
      const reply = await api.judge(request);
      if (key === this.judgedKey) {
        this.judged = { ...reply, of: [wanted, side], doubtful: new Map([...reply.exchanged.flat().map(k => [k, null]),
          ...reply.doubtful.map(({ landmark, expected }) => [landmark, expected])]) };
        performance.measure("pulson:judge", { start: begun, end: performance.now() });
      }
    } catch (error) {
      this.trouble = error.message;
    }
    this.judging = false;
    if (this.judgesAgain) {
      this.judgesAgain = false;
      this.judgedKey = "";
    }
    this.refresh();
  }

  hearResult(map) {
    this.noiseShare = new Map(map?.landmarks.map((k, i) => [k, map.noise_share[i] ?? 0]) ?? []);
    this.residuals = new Map(map?.landmarks.map((k, i) => [k, map.residuals[i]]) ?? []);
    this.askForJudgement();
    this.refresh();
  }
}

try {
  window.pulson = new Page(await api.loadState());
} catch (error) {
  byId("saved").textContent = error.message;
  byId("saved").classList.add("failed");
}
