// The page of an atlas in a real browser: sliders, the map, specimens with their pictures. Usage: as browser_test.mjs

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { openBrowser, packagesOf } from "./session.mjs";

const [chromium, program, samples, work] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), "pulson_atlas_"));
const screens = join(work, "screens");
mkdirSync(screens, { recursive: true });
execFileSync(program, ["atlas", join(samples, "leaves.tps"), "-o", folder, "-q", "--pictures", "png"], { stdio: "pipe" });
const record = JSON.parse(readFileSync(join(folder, "atlas.json"), "utf8"));
const browser = await openBrowser(work, chromium);

try {
  const page = await browser.newPage(), faults = [];
  page.on("pageerror", error => faults.push(String(error)));
  await page.setViewport({ width: 1400, height: 1000 });
  await page.goto(`file://${folder}/report.html`);
  await page.waitForSelector("figure.space svg circle");
  const look = () => page.evaluate(() => {
    const figure = document.querySelector("figure.space"), canvas = figure.querySelector("canvas");
    const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    let sum = 0;
    for (let i = 0; i < pixels.length; i += 97) sum = (31 * sum + pixels[i]) % 1000003;
    return { scores: [...figure.querySelectorAll("[data-score]")].map(({ value }) => value / 100), picked: figure.querySelector("select").value,
      texts: [...figure.querySelectorAll(".scores output")].map(({ textContent }) => textContent), sum };
  });
  const drawn = () => page.evaluate(() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done))));
  await drawn();
  const mean = await look();
  assert.deepEqual(mean.scores, [0, 0, 0]);
  assert.equal(mean.texts[0], "+0.0 s.d.");

  // By the keyboard: one step of the first slider, by the browser's own rule.
  await page.focus("[data-score]");
  for (let i = 0; i < 20; ++i) await page.keyboard.press("PageUp");
  await drawn();
  const moved = await look();
  assert.ok(moved.scores[0] > 0.5 && moved.sum !== mean.sum, "the shape follows the slider");

  // A click on the dot of each specimen: its scores and its picture.
  for (const i of [0, 5]) {
    const dot = (await page.$$("figure.space svg circle"))[i];
    await dot.click();
    await drawn();
    const now = await look();
    assert.equal(now.picked, String(i));
    now.scores.forEach((score, k) => {
      const exact = record.modes.scores[i][k] / Math.sqrt(record.modes.eigenvalues[k]);
      assert.ok(Math.abs(score - exact) < 0.02, `score ${k} of specimen ${i}: ${score} is not ${exact}`);
    });
  }

  // A click beside all dots: the scores of that place, and no specimen.
  const map = await page.$("figure.space svg.map");
  await map.scrollIntoView();
  const box = await map.boundingBox();
  await page.mouse.click(box.x + 0.93 * box.width, box.y + 0.07 * box.height);
  await drawn();
  const free = await look();
  assert.equal(free.picked, "");
  assert.ok(free.scores[0] > 2 && free.scores[1] > 2, JSON.stringify(free.scores));
  await page.click("[data-reset]");
  await drawn();
  assert.deepEqual((await look()).scores, [0, 0, 0]);

  await page.evaluate(readFileSync(packagesOf(work).resolve("axe-core/axe.min.js"), "utf8"));
  for (const [width, dark] of [[1400, false], [390, true]]) {
    await page.setViewport({ width, height: 1000 });
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }]);
    await drawn();
    const { violations } = await page.evaluate(() => window.axe.run("figure.space", { resultTypes: ["violations"] }));
    assert.deepEqual(violations.map(({ id, nodes }) => [id, nodes.map(({ html }) => html.slice(0, 160))]), []);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "no scrolling sideways");
    await page.screenshot({ path: join(screens, `atlas_${width}.png`) });
  }
  assert.deepEqual(faults, []);
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
console.log("all held");
