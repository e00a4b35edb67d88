// The page in a real browser, by real events: two photographs, ten landmarks, a match, a file; killed and gone on; by keyboard
// alone; for eyes and for screen readers. Usage: browser_test.mjs CHROMIUM PULSON SAMPLES WORK

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { Server, click, onScreen, openBrowser, openPage, packagesOf, press, settled, stateOf } from "./session.mjs";

const [chromium, program, samples, work] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), "pulson_view_"));
const screens = join(work, "screens");
mkdirSync(screens, { recursive: true });
for (const name of ["leaf_1.png", "leaf_2.png"]) copyFileSync(join(samples, name), join(folder, name));

// The landmarks of the sample leaves, in rows of their pictures.
const leaves = () => {
  const shapes = [];
  for (const line of readFileSync(join(samples, "leaves.tps"), "utf8").split("\n")) {
    const numbers = line.trim().split(/\s+/).map(Number);
    if (line.startsWith("LM")) shapes.push([]);
    else if (numbers.length === 2 && numbers.every(Number.isFinite)) shapes.at(-1).push([numbers[0], 400 - numbers[1]]);
  }
  return shapes;
};
const [first, second] = leaves();

const axeText = readFileSync(packagesOf(work).resolve("axe-core/axe.min.js"), "utf8");
const expectAccessible = async (page, what) => {
  await page.evaluate(axeText);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  assert.deepEqual(violations.map(({ id, nodes }) => [id, nodes.map(({ html }) => html.slice(0, 160))]), [], what);
};
const near = (a, b, tolerance, what) => assert.ok(Math.hypot(a[0] - b[0], a[1] - b[1]) <= tolerance, `${what}: ${a} is not ${b}`);

let server = await Server.start(program, folder, ["leaf_1.png", "leaf_2.png"]);
const browser = await openBrowser(work, chromium);
const step = text => console.log(`- ${text}`);

try {
  let page = await openPage(browser, server.url);
  await expectAccessible(page, "at the beginning");

  step("clicks place pairs; from the third pair on the next one is proposed, and Enter takes it");
  let taken = 0;
  for (let k = 0; k < 10; ++k) {
    await click(page, 0, first[k]);
    const proposal = await page.evaluate(() => window.pulson.proposal);
    assert.equal(proposal !== null, k >= 3, `landmark ${k + 1}`);
    const isGood = proposal && Math.hypot(proposal.x - second[k][0], proposal.y - second[k][1]) < 6;
    if (k === 3) await page.screenshot({ path: join(screens, "proposal.png") });
    if (isGood) {
      await press(page, "Enter");
      taken += 1;
    } else await click(page, 1, second[k]);
  }
  step("a click a few pixels beside a landmark places the one that is waited for");
  const close = await onScreen(page, 0, first[9]);
  await page.mouse.click(close[0] + 5, close[1] + 1);
  await settled(page);
  assert.equal((await stateOf(page)).landmarks.length, 11);
  await page.keyboard.down("Control");
  await press(page, "z");
  await page.keyboard.up("Control");
  assert.equal((await stateOf(page)).landmarks.length, 10);

  let state = await stateOf(page);
  assert.equal(state.landmarks.length, 10);
  for (let k = 0; k < 10; ++k) {
    near(state.specimens[0].points[k], first[k], 1, "left");
    near(state.specimens[1].points[k], second[k], 7, "right");
  }
  step(`${taken} of 7 proposals were within 6 pixels`);

  step("zooming and panning place nothing; a drag moves one landmark, and is one step of undo");
  const [x, y] = await onScreen(page, 0, [150, 200]);
  await page.mouse.move(x, y);
  await page.mouse.wheel({ deltaY: -400 });
  await page.mouse.down();
  await page.mouse.move(x + 60, y + 40, { steps: 5 });
  await page.mouse.up();
  await settled(page);
  assert.deepEqual(await stateOf(page), state);
  const from = await onScreen(page, 0, state.specimens[0].points[2]);
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move(from[0] + 14, from[1] + 9, { steps: 6 });
  await page.mouse.up();
  await settled(page);
  const moved = await stateOf(page);
  assert.notDeepEqual(moved.specimens[0].points[2], state.specimens[0].points[2]);
  await page.keyboard.down("Control");
  await page.keyboard.press("z");
  await page.keyboard.up("Control");
  await settled(page);
  assert.deepEqual((await stateOf(page)).specimens, state.specimens);
  assert.deepEqual(page.faults, []);
  await page.evaluate(() => window.pulson.photos[0].fit());

  step("the result is there, and its pixels are no blank");
  const colours = await page.evaluate(() => {
    window.pulson.result.paint();
    const gl = window.pulson.result.gl?.gl;
    if (!gl) return 0;
    const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
    gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return new Set(new Uint32Array(pixels.buffer)).size;
  });
  assert.ok(colours > 100, `${colours} colours in the warped picture`);

  step("exchanged landmarks are named, and one key swaps them");
  await page.evaluate(() => window.pulson.apply(
    (document => ({ ...document, specimens: document.specimens.map((specimen, s) => s === 0 ? specimen
      : { ...specimen, points: specimen.points.map((point, k, all) => k === 5 ? all[8] : k === 8 ? all[5] : point) }) }))(window.pulson.now), "test"));
  await settled(page);
  await settled(page);
  assert.match(await page.$eval("#alerts", node => node.textContent), /look exchanged/);
  await page.screenshot({ path: join(screens, "exchanged.png") });
  await expectAccessible(page, "with an alert");
  await page.evaluate(() => document.activeElement.blur());
  await press(page, "x");
  assert.deepEqual((await stateOf(page)).specimens, state.specimens);

  step("pictures of it, light and dark, wide and narrow, without violations of axe-core");
  state = await stateOf(page);
  for (const [width, height] of [[1400, 900], [390, 844]])
    for (const dark of [false, true]) {
      const other = await openPage(browser, server.url, { width, height, dark });
      await settled(other);
      await new Promise(done => setTimeout(done, 150));
      await other.screenshot({ path: join(screens, `view_${width}_${dark ? "dark" : "light"}.png`), fullPage: width < 500 });
      await expectAccessible(other, `${width} ${dark}`);
      const overflow = await other.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      assert.ok(overflow <= 0, `${overflow} pixels too wide at ${width}`);
      assert.deepEqual(other.faults, []);
      await other.close();
    }

  step("two windows: the second to save is asked");
  const other = await openPage(browser, server.url);
  await other.evaluate(() => document.activeElement.blur());
  await click(other, 0, [30, 30]);
  await page.bringToFront();
  await page.mouse.click(...await onScreen(page, 0, [270, 370]));
  await page.waitForFunction(() => document.querySelector("#alerts").textContent.includes("Another window"));
  await page.evaluate(() => [...document.querySelectorAll("#alerts button")].find(({ textContent }) => textContent === "its changes").click());
  await settled(page);
  assert.deepEqual((await stateOf(page)).specimens, (await stateOf(other)).specimens);
  await other.bringToFront();
  await press(other, "Delete");
  await other.close();
  await page.bringToFront();
  await page.reload();
  await page.waitForFunction(() => window.pulson?.photos[0].view);

  step("killed, started again: everything is there, and an end of the server is said");
  await settled(page);
  const last = await stateOf(page);
  await server.end("SIGKILL");
  await page.mouse.click(...await onScreen(page, 0, [40, 40]));
  await page.waitForFunction(() => document.querySelector("#alerts").textContent.includes("Not saved"));
  assert.ok(page.faults.every(text => text.includes("ERR_CONNECTION_REFUSED") || text.includes("409")), page.faults.join());
  server = await Server.start(program, folder, ["leaf_1.png", "leaf_2.png"]);
  page = await openPage(browser, server.url);
  assert.deepEqual((await stateOf(page)).specimens, last.specimens);

  step("the file that is exported is read by pulson info");
  await press(page, "e");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.querySelector("#export-dialog").textContent.includes("holds 2 shapes"));
  await expectAccessible(page, "with the dialog of export");
  const info = execFileSync(program, ["info", "leaf_1.tps"], { cwd: folder, encoding: "utf8" });
  assert.match(info, /2 shapes/);
  assert.match(info, /10 landmarks|landmarks +10/);
  await page.keyboard.press("Escape");

  step("by keyboard alone: focus, cross, space, missing, undo");
  await page.evaluate(() => document.activeElement.blur());
  for (let i = 0; i < 80; ++i) {
    await page.keyboard.press("Tab");
    if (await page.evaluate(() => document.activeElement === window.pulson.photos[0].stage)) break;
  }
  const before = (await stateOf(page)).specimens[0].points.filter(Array.isArray).length;
  for (let i = 0; i < 4; ++i) await press(page, "ArrowLeft");
  await press(page, "ArrowUp");
  await press(page, " ");
  let points = (await stateOf(page)).specimens[0].points;
  assert.equal(points.filter(Array.isArray).length, before + 1);
  assert.ok(points.at(-1)[0] < 150 && points.at(-1)[1] < 200);
  await press(page, "m");
  assert.equal((await stateOf(page)).specimens[1].points.at(-1), "missing");
  for (let i = 0; i < 2; ++i) {
    await page.keyboard.down("Control");
    await press(page, "z");
    await page.keyboard.up("Control");
  }
  points = (await stateOf(page)).specimens[0].points;
  assert.equal(points.filter(Array.isArray).length, before);
  await page.keyboard.press("?");
  await expectAccessible(page, "with the keys");
  await page.screenshot({ path: join(screens, "keys.png") });
  assert.deepEqual(page.faults, []);

  step("pictures are dropped onto an empty page; a broken one is named and not kept");
  await page.close();
  await server.end();
  const empty = mkdtempSync(join(folder, "empty_"));
  server = await Server.start(program, empty, []);
  page = await openPage(browser, server.url, { isEmpty: true });
  const drop = (name, bytes) => page.evaluate((fileName, list) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([Uint8Array.from(list)], fileName));
    window.pulson.photos[0].stage.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }));
  }, name, [...bytes]);
  const specimens = count => page.waitForFunction(wanted => window.pulson.now.specimens.length === wanted, {}, count);
  for (const [i, name] of ["leaf_1.png", "leaf_2.png"].entries()) {
    await drop(name, readFileSync(join(samples, name)));
    await specimens(i + 1);
  }
  await drop("broken.png", readFileSync(join(samples, "leaf_1.png")).subarray(0, 700));
  await page.waitForFunction(() => document.querySelector("#alerts").textContent.includes("broken.png"));
  assert.deepEqual(readdirSync(empty).filter(name => !name.startsWith(".")).sort(), ["landmarks.pulson.json", "leaf_1.png", "leaf_2.png"]);
  await settled(page);
  await click(page, 0, first[0]);
  near((await stateOf(page)).specimens[0].points[0], first[0], 1, "on a dropped picture");
  page.faults = page.faults.filter(text => !text.includes("422"));
  assert.deepEqual(page.faults, []);

  step("a cohort: specimens, strip, names, curve, wireframe, absent, a second pass; undo and redo of all of it");
  await page.close();
  await server.end();
  copyFileSync(join(samples, "leaves.tps"), join(folder, "leaves.tps"));
  server = await Server.start(program, folder, ["leaves.tps"]);
  page = await openPage(browser, server.url);
  const opened = await stateOf(page);
  await press(page, "]");
  assert.equal((await stateOf(page)).shown[1], 2);
  await page.evaluate(() => document.querySelector(".row button").click());
  await page.waitForFunction(() => document.querySelectorAll("#strip canvas").length === 1); // of two others with pictures, leaf_1 is shown
  await press(page, "[");
  assert.deepEqual(await stateOf(page), opened);
  await page.evaluate(() => document.querySelector(".row input").focus());
  await page.keyboard.type("base");
  await press(page, "Enter");
  await press(page, "c");
  for (const side of [0, 1]) for (const place of [[40, 350], [40, 250], [60, 150]]) await click(page, side, place);
  await press(page, "Enter");
  const withCurve = await stateOf(page);
  assert.equal(withCurve.landmarks.length, 29);
  assert.deepEqual(withCurve.specimens[0].points[28], withCurve.specimens[1].points[28]);
  await press(page, "w");
  await click(page, 0, first[0]);
  await click(page, 0, first[1]);
  assert.deepEqual((await stateOf(page)).links.at(-1), [0, 1]);
  await press(page, "Escape");
  await click(page, 0, [20, 20]);
  await press(page, "a");
  assert.equal((await stateOf(page)).specimens[1].points.at(-1), "absent");
  await press(page, "r");
  await click(page, 0, [first[0][0] + 3, first[0][1]]);
  const all = await stateOf(page);
  assert.equal(all.landmarks[0].name, "base");
  assert.ok(Math.abs(all.specimens[0].second[0][0] - first[0][0] - 3) < 1);
  const steps = await page.evaluate(() => window.pulson.history.past.length);
  const control = async key => {
    await page.keyboard.down("Control");
    await press(page, key);
    await page.keyboard.up("Control");
  };
  for (let i = 0; i < steps; ++i) await control("z");
  assert.deepEqual(await stateOf(page), opened);
  for (let i = 0; i < steps; ++i) await control("y");
  assert.deepEqual(await stateOf(page), all);
  assert.deepEqual(page.faults, []);

  step("results: their pictures, the residual of each landmark, and the report, which reaches nothing of the page");
  await page.close();
  await server.end();
  execFileSync(program, ["register", "leaves.tps#1", "leaves.tps#2", "-o", "out"], { cwd: folder, stdio: "ignore" });
  server = await Server.start(program, folder, ["out"]);
  page = await openPage(browser, server.url);
  assert.match(await page.$eval(".row .state", node => node.textContent), /^● ● · 0\.\d+ px$/);
  await page.evaluate(() => document.activeElement.blur());
  const known = new Set(browser.targets());
  const target = browser.waitForTarget(one => one.type() === "page" && !known.has(one));
  await page.keyboard.press("p");
  const report = await (await target).page();
  await report.waitForFunction(() => document.title.includes("leaf_1 → leaf_2") && [...document.images].every(image => image.naturalWidth > 0));
  assert.equal(await report.evaluate(() => self.origin), "null");
  await report.close();
  assert.deepEqual(page.faults, []);
} finally {
  await browser.close();
  await server.end();
  rmSync(folder, { recursive: true, force: true });
}
console.log("all held");
