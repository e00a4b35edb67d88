// From the move of one landmark to the picture that shows it, in a real browser: median and 95th percentile, milliseconds; and
// the processor time of it, which other programs hardly change: of the page's main thread for a move, and of the program for
// a match in full, for one that follows the last, and for the linear model.
// Usage: latency.mjs CHROMIUM PULSON WORK [N ...]; WORK is where run_page_test put the packages of npm. No test: a machine that
// does something else is slower.

import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { readMap } from "../../../src/view/page/api.js";
import { Server, onScreen, openBrowser, openPage, settled } from "./session.mjs";

const [chromium, program, work, ...counts] = process.argv.slice(2);
const kSide = 1000, kMoves = 20;

// Numbers that look random and are the same in each run.
let state = 1;
const random = () => (state = (state * 48271) % 2147483647) / 2147483647;

const picture = () => {
  const bytes = Buffer.alloc(3 * kSide * kSide);
  for (let y = 0, i = 0; y < kSide; ++y)
    for (let x = 0; x < kSide; ++x, i += 3) {
      bytes[i] = 128 + 100 * Math.sin(x / 30);
      bytes[i + 1] = 128 + 100 * Math.sin(y / 40);
      bytes[i + 2] = 128 + 100 * Math.sin((x + y) / 90);
    }
  return Buffer.concat([Buffer.from(`P6 ${kSide} ${kSide} 255\n`), bytes]);
};

const landmarks = count => {
  const left = [], right = [];
  for (let k = 0; k < count; ++k) {
    const [x, y] = [100 + 800 * random(), 100 + 800 * random()];
    left.push([x, y]);
    right.push([x + 30 * Math.sin(y / 200) + 2 * random(), y + 30 * Math.cos(x / 180) + 2 * random()]);
  }
  return [left, right];
};

const csv = points => `x,y\n${points.map(point => point.join(",")).join("\n")}\n`;
// Of a process until now, milliseconds: utime and stime of /proc, in hundredths of a second.
const processorTime = pid => {
  const fields = readFileSync(`/proc/${pid}/stat`, "utf8").split(") ")[1].split(" ");
  return 10 * (Number(fields[11]) + Number(fields[12]));
};

// The program's for requests of one kind, each after a move of one landmark.
const programTimes = async (server, left, right) => {
  const grid = { width: kSide, height: kSide, columns: 33, rows: 33, noise: "none" };
  const ask = async (more, i) => {
    const moved = right.map((place, k) => k ? place : [place[0] + 5 * Math.sin(i), place[1] + 5 * Math.cos(i)]);
    const reply = await fetch(`${server.url}match`, { method: "POST", body: JSON.stringify({ left, right: moved, ...grid, ...more }) });
    if (!reply.ok) throw new Error(await reply.text());
    return readMap(await reply.arrayBuffer());
  };
  const { kernel, ridge } = await ask({}, 0), times = [];
  for (const [name, more] of [["full", {}], ["follow", { follow: true }], ["linear", { linear: kernel, ridge }]]) {
    const begun = processorTime(server.child.pid);
    for (let i = 1; i <= kMoves; ++i) await ask(more, i);
    times.push(`${name} ${((processorTime(server.child.pid) - begun) / kMoves).toFixed(1)}`);
  }
  return times.join(", ");
};

const quantile = (values, part) => values[Math.min(values.length - 1, Math.floor(part * values.length))];

const browser = await openBrowser(work, chromium);
try {
  for (const count of counts.length ? counts.map(Number) : [10, 50, 200]) {
    const folder = mkdtempSync(join(tmpdir(), "pulson_view_"));
    const [left, right] = landmarks(count);
    for (const [name, points] of [["l", left], ["r", right]]) {
      writeFileSync(join(folder, `${name}.ppm`), picture());
      writeFileSync(join(folder, `${name}.csv`), csv(points));
    }
    const server = await Server.start(program, folder, ["l.csv", "r.csv", "l.ppm", "r.ppm"]);
    const page = await openPage(browser, server.url);
    await page.evaluate(() => addEventListener("pointermove", event => { window.movedAt = event.timeStamp; }, true));
    const place = await onScreen(page, 1, right[0]);
    await page.mouse.move(...place);
    await page.mouse.down();
    await page.mouse.move(place[0] + 6, place[1]);
    await settled(page);
    const times = { effect: [], match: [], judge: [] }, pageTimes = [];
    const session = await page.createCDPSession();
    await session.send("Performance.enable", { timeDomain: "threadTicks" });
    const pageTime = async () => 1000 * (await session.send("Performance.getMetrics")).metrics.find(({ name }) => name === "TaskDuration").value;
    for (let i = 0; i < kMoves; ++i) {
      const before = await pageTime();
      await page.evaluate(() => performance.clearMeasures());
      await page.mouse.move(place[0] + 6 + 5 * Math.sin(i), place[1] + 5 * Math.cos(i));
      await settled(page);
      pageTimes.push(await pageTime() - before);
      const found = await page.evaluate(() => ["effect", "match", "judge"].map(name => {
        const last = performance.getEntriesByName(`pulson:${name}`).at(-1);
        return last ? last.startTime + last.duration - window.movedAt : null;
      }));
      if (found[0] !== null) times.effect.push(found[0]);
      if (found[1] !== null) times.match.push(found[1]);
      if (found[2] !== null) times.judge.push(found[2]);
    }
    await page.mouse.up();
    const texts = Object.entries(times).map(([name, values]) => {
      values.sort((a, b) => a - b);
      return `${name} ${quantile(values, 0.5)?.toFixed(0)} (${quantile(values, 0.95)?.toFixed(0)}) ms of ${values.length}`;
    });
    console.log(`N = ${count}: ${texts.join(", ")}`);
    pageTimes.sort((a, b) => a - b);
    await page.close();
    console.log(`  processor time: page ${quantile(pageTimes, 0.5).toFixed(0)} ms a move, program ${await programTimes(server, left, right)} ms`);
    await server.end();
    rmSync(folder, { recursive: true, force: true });
  }
} finally {
  await browser.close();
}
