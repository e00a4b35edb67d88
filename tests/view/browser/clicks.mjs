// From two photographs to a warped picture, by real events: counts every click and key. Usage: clicks.mjs CHROMIUM PULSON SAMPLES WORK
// The landmarks are the ten first of the sample leaves. A proposal that lies within six pixels is taken by Enter; else
// the place is clicked. What people need besides, looking and aiming, is in no number here.

import { copyFileSync, mkdtempSync, readFileSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { Server, onScreen, openBrowser, openPage, settled } from "./session.mjs";

const [chromium, program, samples, work] = process.argv.slice(2);
const kLandmarks = 10, kRight = 6; // pixels of the picture, 2 % of its width
const folder = mkdtempSync(join(tmpdir(), "pulson_view_"));
for (const name of ["leaf_1.png", "leaf_2.png"]) copyFileSync(join(samples, name), join(folder, name));
const shapes = [];
for (const line of readFileSync(join(samples, "leaves.tps"), "utf8").split("\n")) {
  const numbers = line.trim().split(/\s+/).map(Number);
  if (line.startsWith("LM")) shapes.push([]);
  else if (numbers.length === 2 && numbers.every(Number.isFinite)) shapes.at(-1).push([numbers[0], 400 - numbers[1]]);
}

const server = await Server.start(program, folder, ["leaf_1.png", "leaf_2.png"]);
const browser = await openBrowser(work, chromium);
try {
  const page = await openPage(browser, server.url);
  const count = { clicks: 0, keys: 0 }, begun = performance.now();
  const click = async (side, place) => {
    count.clicks += 1;
    await page.mouse.click(...await onScreen(page, side, place));
    await settled(page);
  };
  const press = async key => {
    count.keys += 1;
    await page.keyboard.press(key);
    await settled(page);
  };
  let warped = null;
  for (let k = 0; k < kLandmarks; ++k) {
    await click(0, shapes[0][k]);
    const proposal = await page.evaluate(() => window.pulson.proposal);
    const isRight = proposal && Math.hypot(proposal.x - shapes[1][k][0], proposal.y - shapes[1][k][1]) < kRight;
    if (isRight) await press("Enter");
    else await click(1, shapes[1][k]);
    if (!warped && await page.evaluate(() => window.pulson.result.map !== null)) warped = { ...count, pairs: k + 1 };
  }
  const placed = { ...count };
  await press("e");
  await press("Enter");
  await page.waitForFunction(() => document.querySelector("#export-dialog").textContent.includes("holds 2 shapes"));
  const text = ({ clicks, keys }) => `${clicks} clicks and ${keys} keys`;
  console.log(`a warped picture after ${text(warped)} (${warped.pairs} pairs)`);
  console.log(`${kLandmarks} pairs after ${text(placed)}`);
  console.log(`in a file of ${statSync(join(folder, "leaf_1.tps")).size} bytes after ${text(count)}`);
  console.log(`the page and the program took ${((performance.now() - begun) / 1000).toFixed(1)} s of it`);
} finally {
  await browser.close();
  await server.end();
  rmSync(folder, { recursive: true, force: true });
}
