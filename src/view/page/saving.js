// Saves the document after each action, one request at a time; while one is on its way only the newest waits.

import { addSpecimens } from "./actions.js";
import { addPicture } from "./api.js";

const kFirstWait = 500, kLongestWait = 8000; // milliseconds between tries

export class Saver {
  // `send(document, base)` resolves to {revision} or rejects with {status, reply}; `report(state, error)` hears
  // "saved", "saving", "failed" and "conflict"; `wait` is setTimeout.
  constructor(revision, send, report, wait = (action, time) => setTimeout(action, time)) {
    Object.assign(this, { revision, send, report, wait, waiting: null, busy: false, delay: kFirstWait, stopped: false });
  }

  get isSaved() { return !this.busy && this.waiting === null; }

  save(document) {
    this.waiting = document;
    if (!this.busy && !this.stopped) return this.next();
    return undefined;
  }

  async next() {
    const document = this.waiting;
    this.waiting = null;
    this.busy = true;
    this.report("saving");
    try {
      const { revision } = await this.send(document, this.revision);
      this.revision = revision;
      this.delay = kFirstWait;
      this.busy = false;
      if (this.waiting !== null) await this.next();
      else this.report("saved");
    } catch (error) {
      this.busy = false;
      this.waiting ??= document;
      if (error.status === 409) {
        this.stopped = true;
        this.report("conflict", error);
        return;
      }
      this.report("failed", error);
      this.busy = true;
      this.wait(() => {
        this.busy = false;
        if (!this.stopped && this.waiting !== null) this.next();
      }, this.delay);
      this.delay = Math.min(kLongestWait, 2 * this.delay);
    }
  }

  // Nothing is saved between these; what was to be saved is then `document`.
  hold() { this.busy = true; }

  release(revision, document) {
    this.busy = false;
    this.revision = revision;
    if (this.waiting === null || this.stopped) return;
    this.waiting = document;
    this.next();
  }

  // After a conflict: goes on from the revision that the file has, with what is here or with nothing.
  resume(revision, keepsOwn) {
    this.revision = revision;
    this.stopped = false;
    if (!keepsOwn) this.waiting = null;
    if (this.waiting !== null && !this.busy) this.next();
    else this.report("saved");
  }
}

// What is placed while a picture is on its way stays, and is saved then; so do the steps of undo.
const takePicture = async (page, file) => {
  page.saver.hold();
  let { revision } = page.saver;
  try {
    const { document } = await addPicture(file);
    revision = document.revision;
    page.history.rebase(old => addSpecimens(old, document.specimens.slice(old.specimens.length)));
  } finally {
    page.saver.release(revision, page.now);
  }
};

// Adds files as pictures, one after the other; those that are none are named on the page.
export const takePictures = async (page, files) => {
  for (const file of files) {
    try {
      await page.saved();
      await takePicture(page, file);
      page.trouble = null;
    } catch (error) {
      page.trouble = error.message;
      page.refresh();
    }
  }
};
