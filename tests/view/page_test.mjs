// The modules of the page that need no browser: node --test tests/view/page_test.mjs

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, readdirSync } from "node:fs";
import { dirname, join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

import * as actions from "../../src/view/page/actions.js";
import { readMap } from "../../src/view/page/api.js";
import * as geometry from "../../src/view/page/geometry.js";
import { Result } from "../../src/view/page/result.js";
import { Saver } from "../../src/view/page/saving.js";
import { History } from "../../src/view/page/state.js";
import { between, cellsOf } from "../../src/view/page/warp.js";

const specimen = (name, points = []) => ({ name, picture: `${name}.png`, width: 100, height: 80, points });
const fresh = () => ({ landmarks: [], links: [], shown: [0, 1], specimens: [specimen("a"), specimen("b")] });
const near = (a, b, tolerance = 1e-9) => assert.ok(Math.abs(a - b) <= tolerance, `${a} is not ${b}`);

test("a place of the screen is found again after any zoom and pan", () => {
  let view = geometry.fitView(300, 200, 640, 480);
  view = geometry.zoomAt(view, 3.7, [100, 50], 0.01, 40);
  view = geometry.panBy(view, -31, 17);
  const back = geometry.toPicture(view, geometry.toScreen(view, [12.25, 180]));
  near(back[0], 12.25);
  near(back[1], 180);
});

test("zooming keeps what is under the pointer, also at the limits", () => {
  const view = geometry.fitView(300, 200, 640, 480), at = [222, 111], before = geometry.toPicture(view, at);
  for (const factor of [1.5, 0.2, 1e6]) {
    const after = geometry.toPicture(geometry.zoomAt(view, factor, at, 0.5, 40), at);
    near(after[0], before[0], 1e-7);
    near(after[1], before[1], 1e-7);
  }
});

test("the picture's first corner is half a pixel before the centre of its first pixel", () => {
  const view = geometry.fitView(10, 10, 124, 124);
  assert.deepEqual(geometry.toScreen(view, [-0.5, -0.5]), [12, 12]);
});

test("wide pictures stand one above the other, tall ones side by side", () => {
  assert.equal(geometry.areLargerStacked([[300, 200], [300, 200]], 1000, 800), true);
  assert.equal(geometry.areLargerStacked([[300, 400], [300, 400]], 1000, 700), false);
});

test("the axes of an ellipse are those of its matrix", () => {
  // Turned by 30 degrees, half axes 5 and 2: M = R diag(25, 4) R'.
  const c = Math.cos(Math.PI / 6), s = Math.sin(Math.PI / 6);
  const axes = geometry.ellipseAxes({ xx: 25 * c * c + 4 * s * s, xy: 21 * c * s, yy: 25 * s * s + 4 * c * c });
  near(axes.rx, 5);
  near(axes.ry, 2);
  near(axes.angle, 30);
});

test("semilandmarks lie at equal distances along the line, its ends among them", () => {
  const points = geometry.spread([[0, 0], [3, 0], [3, 0], [3, 9]], 5);
  assert.deepEqual(points, [[0, 0], [3, 0], [3, 3], [3, 6], [3, 9]]);
});

test("repeats show the error of one digitising", () => {
  // Differences of (1, 1): each has the variance 2 sigma^2 in a coordinate, so sigma^2 is 1/2.
  near(geometry.repeatError([[[0, 0], [1, 1]], [[5, 5], [4, 4]]]), Math.SQRT1_2);
  assert.equal(geometry.repeatError([]), null);
});

test("undo and redo go through every action, and a new one ends what could be done again", () => {
  const history = new History(fresh()), seen = [];
  history.listen((_, reason) => seen.push(reason));
  const states = [history.now];
  const doing = [
    document => actions.place(document, 0, 0, [1, 2]),
    document => actions.place(document, 1, 0, [3, 4]),
    document => actions.rename(document, 0, "tip"),
    document => actions.place(document, 0, 1, [5, 6]),
    document => actions.mark(document, 1, 1, "missing"),
    document => actions.toggleLink(document, 0, 1),
    document => actions.swap(document, 0, 0, 1),
    document => actions.placeCurve(document, 0, [[0, 0], [10, 0]], 4),
    document => actions.removeLandmark(document, 0),
    document => actions.startSecondPass(document),
  ];
  for (const action of doing) {
    history.apply(action(history.now), "step");
    states.push(history.now);
  }
  for (let i = doing.length; i > 0; --i) {
    assert.deepEqual(history.now, states[i]);
    assert.ok(history.undo());
  }
  assert.deepEqual(history.now, states[0]);
  assert.equal(history.undo(), false);
  for (let i = 1; i <= doing.length; ++i) {
    assert.ok(history.redo());
    assert.deepEqual(history.now, states[i]);
  }
  history.undo();
  history.apply(actions.rename(history.now, 0, "new"), "name");
  assert.equal(history.redo(), false);
  assert.ok(seen.every(reason => reason === "change"));
});

test("a drag is one step, two drags are two", () => {
  const history = new History(actions.place(fresh(), 0, 0, [1, 1]));
  for (const x of [2, 3, 4]) history.apply(actions.place(history.now, 0, 0, [x, 1]), "move", "move 0 0");
  history.seal();
  for (const x of [5, 6]) history.apply(actions.place(history.now, 0, 0, [x, 1]), "move", "move 0 0");
  history.undo();
  assert.deepEqual(history.now.specimens[0].points, [[4, 1]]);
  history.undo();
  assert.deepEqual(history.now.specimens[0].points, [[1, 1]]);
});

test("a picture that is added is in every state, and no step", () => {
  const history = new History(fresh());
  history.apply(actions.place(history.now, 0, 0, [1, 2]), "place 1");
  history.apply(actions.place(history.now, 0, 1, [3, 4]), "place 2");
  history.undo();
  history.rebase(document => actions.addSpecimens(document, [specimen("c", [[9, 9]])]));
  assert.deepEqual(history.now.specimens[2].points, [null]);
  history.redo();
  assert.deepEqual(history.now.specimens.map(({ points }) => points), [[[1, 2], [3, 4]], [null, null], [null, null]]);
  history.undo();
  history.undo();
  assert.deepEqual(history.now.specimens.map(({ name, points }) => [name, points]), [["a", []], ["b", []], ["c", []]]);
});

test("what is placed while a picture is on its way is saved after it", async () => {
  const sent = [];
  const saver = new Saver(1, async (document, base) => { sent.push([document, base]); return { revision: base + 1 }; }, () => {});
  saver.hold();
  saver.save("without the picture");
  assert.equal(saver.isSaved, false);
  assert.deepEqual(sent, []);
  saver.release(2, "with it");
  for (let i = 0; i < 10; ++i) await null;
  assert.deepEqual(sent, [["with it", 2]]);
  assert.ok(saver.isSaved);
});

test("going to another specimen is no step, and undo stays there", () => {
  const begin = { ...fresh(), specimens: [specimen("a"), specimen("b"), specimen("c")] };
  const history = new History(begin);
  history.apply(actions.place(history.now, 0, 0, [1, 1]), "place");
  history.show(actions.show(history.now, 1, 2));
  history.undo();
  assert.deepEqual(history.now.shown, [0, 2]);
  assert.equal(history.undo(), false);
});

test("a click places what is lacking: at hand, then next, then new", () => {
  let document = fresh();
  assert.equal(actions.nextFor(document, 0, 0), 0);
  document = actions.place(document, 0, 0, [1, 1]);
  document = actions.place(document, 0, 1, [2, 2]);
  document = actions.place(document, 0, 2, [3, 3]);
  assert.equal(actions.nextFor(document, 0, 1), 3);
  assert.equal(actions.nextFor(document, 1, 1), 1);
  document = actions.mark(actions.place(document, 1, 1, [9, 9]), 1, 2, "absent");
  assert.equal(actions.nextFor(document, 1, 1), 0);
});

test("all specimens have as many places as there are landmarks, whatever is done", () => {
  let document = actions.startSecondPass(actions.place(fresh(), 0, 0, [1, 1]));
  document = actions.placeCurve(document, 1, [[0, 0], [4, 4]], 3, "second");
  document = actions.removeLandmark(actions.place(document, 0, 4, [2, 2]), 1);
  for (const { points, second } of document.specimens) {
    assert.equal(points.length, document.landmarks.length);
    assert.equal(second.length, document.landmarks.length);
  }
  assert.ok(document.links.every(link => link.every(k => k >= 0 && k < document.landmarks.length)));
});

test("a landmark that was taken off all pictures is forgotten, unless it has a name", () => {
  let document = actions.place(actions.place(fresh(), 0, 0, [1, 1]), 1, 0, [2, 2]);
  document = actions.mark(document, 0, 0, null);
  assert.equal(actions.isForgotten(document, 0), false);
  document = actions.mark(document, 1, 0, null);
  assert.equal(actions.isForgotten(document, 0), true);
  assert.equal(actions.isForgotten(actions.rename(document, 0, "tip"), 0), false);
});

test("a curve on the other picture takes the same semilandmarks", () => {
  let document = actions.placeCurve(fresh(), 0, [[0, 0], [10, 0]], 5);
  document = actions.placeCurve(document, 1, [[0, 5], [0, 25]], 99);
  assert.equal(document.landmarks.length, 5);
  assert.deepEqual(document.specimens[1].points[4], [0, 25]);
  document = actions.placeCurve(document, 1, [[1, 1], [2, 2]], 3);
  assert.deepEqual(actions.curvesOf(document).map(({ group, landmarks }) => [group, landmarks.length]),
    [["curve 1", 5], ["curve 2", 3]]);
});

// A server that can be made to fail.
const server = () => {
  const made = { revision: 3, kept: null, failures: 0, calls: 0 };
  made.send = async (document, base) => {
    made.calls += 1;
    await null;
    if (made.failures > 0) {
      made.failures -= 1;
      throw Object.assign(new Error("disk full"), { status: 507 });
    }
    if (base !== made.revision) throw Object.assign(new Error("conflict"), { status: 409, reply: { document: made.kept } });
    made.revision += 1;
    made.kept = document;
    return { revision: made.revision };
  };
  return made;
};
const settled = () => new Promise(done => setTimeout(done, 5));

test("of changes that come while one is saved the newest is saved next", async () => {
  const made = server(), saver = new Saver(3, made.send, () => {});
  for (let i = 0; i < 20; ++i) saver.save({ i });
  while (!saver.isSaved) await settled();
  assert.deepEqual(made.kept, { i: 19 });
  assert.equal(made.calls, 2);
  assert.ok(saver.isSaved);
});

test("what could not be saved is tried again until it is", async () => {
  const made = server(), waits = [], told = [];
  made.failures = 3;
  const saver = new Saver(3, made.send, what => told.push(what), (action, time) => { waits.push(time); setTimeout(action, 0); });
  saver.save({ a: 1 });
  saver.save({ a: 2 });
  while (!saver.isSaved) await settled();
  assert.deepEqual(made.kept, { a: 2 });
  assert.deepEqual(waits, [500, 1000, 2000]);
  assert.equal(told.at(-1), "saved");
});

test("another window's changes are not overwritten unless that is chosen", async () => {
  const made = server(), told = [];
  const saver = new Saver(2, made.send, what => told.push(what));
  saver.save({ mine: true });
  await settled();
  assert.equal(told.at(-1), "conflict");
  saver.save({ mine: 2 });
  await settled();
  assert.equal(made.kept, null);
  saver.resume(3, true);
  await settled();
  assert.deepEqual(made.kept, { mine: 2 });
});

test("a map is read as it is written", () => {
  const head = JSON.stringify({ columns: 2, rows: 2, times: [0, 1], landmarks: [4] });
  const padded = head.padEnd(Math.ceil(head.length / 4) * 4), numbers = Float32Array.from({ length: 24 }, (_, i) => i);
  const bytes = new Uint8Array(4 + padded.length + 96);
  new DataView(bytes.buffer).setUint32(0, padded.length, true);
  bytes.set(new TextEncoder().encode(padded), 4);
  bytes.set(new Uint8Array(numbers.buffer), 4 + padded.length);
  const map = readMap(bytes.buffer);
  assert.deepEqual([...map.frames[1]], [8, 9, 10, 11, 12, 13, 14, 15]);
  assert.deepEqual([...map.paths[1]], [18, 19]);
  assert.deepEqual([...map.jacobians], [20, 21, 22, 23]);
  assert.equal(between(map, map.frames, 0.25)[0], 2);
  assert.deepEqual([...cellsOf(map)], [0, 1, 2, 1, 3, 2]);
});

// ---- which match is asked for

// A page that shows nothing: the program takes `seconds` for each kind of request, and what is asked and shown is listed.
const askingResult = seconds => {
  const asked = [], shown = [], pending = [];
  globalThis.fetch = (path, { body }) => new Promise(done => {
    const { follow, linear } = JSON.parse(body), kind = linear ? "linear" : follow ? "follow" : "match";
    asked.push(kind);
    pending.push((status = 200) => {
      const head = JSON.stringify({ columns: 0, rows: 0, times: [], landmarks: [], seconds: seconds[kind], kernel: "k", ridge: 1,
        linear: kind === "linear", followed: kind === "follow" }).padEnd(400);
      const bytes = new Uint8Array(4 + head.length);
      new DataView(bytes.buffer).setUint32(0, head.length, true);
      bytes.set(new TextEncoder().encode(head), 4);
      done({ ok: status < 300, status, arrayBuffer: async () => bytes.buffer, json: async () => ({ error: "no" }) });
    });
  });
  const result = Object.assign(Object.create(Result.prototype), { wanted: null, busy: 0, turn: 0, isQuick: false, key: "", sizes: [[9, 9], [9, 9]],
    noise: { on: false }, status: {}, tell: () => {}, matched: { seconds: 1, kernel: "k", ridge: 1, noise: "none" } });
  result.take = function take(map, request) {
    this.remember(map, request);
    shown.push(`${map.linear ? "linear" : map.followed ? "follow" : "match"} ${request.left[0][0]}`);
  };
  const move = x => result.update([[x, 0], [1, 0], [0, 1]], [[0, 0], [1, 0], [0, 1]]);
  const answer = async status => {
    pending.shift()(status);
    for (let i = 0; i < 10; ++i) await null;
  };
  const pause = () => new Promise(done => setTimeout(done, 150));
  return { result, asked, shown, move, answer, pause };
};

test("a match follows the last one at once, and is made in full when nothing moves any more", async () => {
  const { result, asked, shown, move, answer, pause } = askingResult({ follow: 0.02, match: 1 });
  move(1);
  move(2); // waits for the first
  assert.deepEqual(asked, ["follow"]);
  await answer();
  assert.deepEqual(asked, ["follow", "follow"]);
  await answer();
  await pause();
  assert.deepEqual(asked, ["follow", "follow", "match"]);
  move(3); // does not wait for a match in full
  assert.deepEqual(asked.slice(3), ["follow"]);
  await answer(); // the old match in full, which is no longer wanted
  await answer();
  await pause();
  await answer(204); // for another window's move: once more
  await pause();
  await answer();
  assert.deepEqual(shown, ["follow 1", "follow 2", "follow 3", "match 3"]);
  assert.equal(result.busy, 0);
});

test("where following is slow the linear model comes first, and nothing where a match in full is quick", async () => {
  const slow = askingResult({ follow: 0.3, match: 1, linear: 0.01 });
  slow.move(1);
  await slow.answer();
  slow.move(2);
  assert.deepEqual(slow.asked, ["follow", "linear"]);
  await slow.answer();
  const quick = askingResult({ match: 0.02 });
  quick.result.matched.seconds = 0.02;
  quick.move(1);
  await quick.answer();
  assert.deepEqual(quick.asked, ["match"]);
  assert.deepEqual(quick.shown, ["match 1"]);
  assert.equal(quick.result.busy, 0);
});

// ---- the text of the scripts, those of reports too

const root = join(dirname(fileURLToPath(import.meta.url)), "../..");
const scriptsOf = folder => readdirSync(join(root, folder)).filter(name => name.endsWith(".js")).map(name => join(root, folder, name));
const withoutTexts = text => text.replace(/\/\/.*$|\/\*[\s\S]*?\*\//gm, "").replace(/"(?:[^"\\\n]|\\.)*"/g, '""');

test("every script parses", () => {
  for (const file of [...scriptsOf("src/view/page"), ...scriptsOf("src/html/page")])
    execFileSync(process.execPath, ["--check", file], { stdio: "pipe" });
});

test("no module imports what it does not use, nor what is not there", async () => {
  for (const file of scriptsOf("src/view/page")) {
    const text = withoutTexts(readFileSync(file, "utf8").replace(/^import [^;]*;/gm, ""));
    for (const [, named, all, from] of readFileSync(file, "utf8").matchAll(/^import (?:\{([^}]*)\}|\* as (\w+)) from "\.\/(.*)";/gm)) {
      const exported = readFileSync(join(root, "src/view/page", from), "utf8");
      for (const name of all ? [all] : named.split(",").map(one => one.trim())) {
        assert.match(text, new RegExp(`\\b${name}\\b`), `${file} does not use ${name}`);
        if (!all) assert.match(exported, new RegExp(`export (?:async )?(?:const|class|function) ${name}\\b`), `${from} has no ${name}`);
      }
    }
  }
});

test("no constant is declared in vain, and nothing is made of text as HTML or as a program", () => {
  for (const file of [...scriptsOf("src/view/page"), ...scriptsOf("src/html/page")]) {
    const text = withoutTexts(readFileSync(file, "utf8"));
    for (const [, name] of text.matchAll(/^(?:const|let|class) (\w+)/gm))
      assert.ok(text.match(new RegExp(`\\b${name}\\b`, "g")).length > 1 || scriptsOf("src/html/page").some(other =>
        other !== file && new RegExp(`\\b${name}\\b`).test(readFileSync(other, "utf8"))), `${file} declares ${name} in vain`);
    assert.doesNotMatch(text, /\binnerHTML\b|\beval\(|new Function\b|document\.write/, file);
  }
  assert.doesNotMatch(readFileSync(join(root, "src/view/page/index.html"), "utf8"), /\son\w+=|<script>(?!<)/);
});
