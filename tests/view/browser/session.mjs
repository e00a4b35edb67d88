// A running `pulson view` and the page in chromium, as tests use them.

import { spawn } from "node:child_process";
import { once } from "node:events";
import { createRequire } from "node:module";
import { join } from "node:path";

// What npm installed is in another folder than the tests.
export const packagesOf = work => createRequire(join(work, "package.json"));

export class Server {
  static async start(program, folder, files, more = []) {
    const made = new Server();
    made.child = spawn(program, ["view", "--no-browser", ...more, ...files], { cwd: folder, stdio: ["ignore", "pipe", "inherit"] });
    made.url = await new Promise((done, fail) => {
      let text = "";
      made.child.stdout.on("data", bytes => {
        text += bytes;
        if (text.includes("\n")) done(text.slice(0, text.indexOf("\n")));
      });
      made.child.on("exit", code => fail(new Error(`pulson view ended with ${code}`)));
    });
    return made;
  }

  async end(signal = "SIGKILL") {
    if (this.child.exitCode !== null || this.child.signalCode !== null) return;
    this.child.kill(signal);
    await once(this.child, "exit");
  }
}

export const openBrowser = (work, chromium) =>
  packagesOf(work)("puppeteer-core").launch({
    executablePath: chromium,
    headless: true,
    args: ["--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-first-run"],
  });

export const openPage = async (browser, url, { width = 1400, height = 900, dark = false, isEmpty = false } = {}) => {
  const page = await browser.newPage();
  page.faults = [];
  page.on("pageerror", error => page.faults.push(String(error)));
  page.on("console", message => { if (message.type() === "error") page.faults.push(message.text()); });
  await page.setViewport({ width, height, isMobile: width < 500, hasTouch: width < 500 });
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }]);
  await page.goto(url);
  await page.waitForFunction(empty => window.pulson && (empty || window.pulson.result.sizes) && window.pulson.saver.isSaved, {}, isEmpty);
  await settled(page);
  return page;
};

// Until nothing is on its way.
export const settled = page => page.waitForFunction(() => {
  const { saver, judging, judgesAgain, refreshing, result } = window.pulson;
  return saver.isSaved && !judging && !judgesAgain && !refreshing && !result.busy && !result.drawing;
}, { timeout: 30000, polling: 20 });

// Where a pixel of a picture is on the screen.
export const onScreen = (page, side, place) => page.evaluate((which, [x, y]) => {
  const photo = window.pulson.photos[which], box = photo.stage.getBoundingClientRect();
  return [box.left + photo.view.x + photo.view.scale * (x + 0.5), box.top + photo.view.y + photo.view.scale * (y + 0.5)];
}, side, place);

export const click = async (page, side, place) => {
  await page.mouse.click(...await onScreen(page, side, place));
  await settled(page);
};

export const stateOf = page => page.evaluate(() => window.pulson.now);

export const press = async (page, key) => {
  await page.keyboard.press(key);
  await settled(page);
};
