// The picture of docs/view.md. Usage: picture.mjs CHROMIUM PULSON SAMPLES WORK OUT.png

import { copyFileSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";

import { Server, click, openBrowser, openPage, settled } from "./session.mjs";

const [chromium, program, samples, work, out] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), "pulson_view_"));
for (const name of ["leaf_1.png", "leaf_2.png", "leaves.tps"]) copyFileSync(join(samples, name), join(folder, name));
const server = await Server.start(program, folder, ["leaves.tps"]);
const browser = await openBrowser(work, chromium);
try {
  const page = await openPage(browser, server.url, { width: 1280, height: 800 });
  await click(page, 0, [126.4, 335]); // one more on the left, so that the page proposes it on the right
  await settled(page);
  await page.mouse.move(5, 5);
  await settled(page);
  await page.screenshot({ path: resolve(out) });
} finally {
  await browser.close();
  await server.end();
  rmSync(folder, { recursive: true, force: true });
}
