// The document with its history. Documents are never changed, only replaced; what did not change is shared.

const kMost = 2000; // documents share what they have in common, so that many are small

export class History {
  constructor(document) {
    this.past = [];
    this.future = [];
    this.now = document;
    this.listeners = new Set();
  }

  listen(listener) { this.listeners.add(listener); }

  tell(reason) { this.listeners.forEach(listener => listener(this.now, reason)); }

  // `what` is the name of the action, which the button of undo shows. With `joins`, a change that goes on with the last
  // one of that key, as each step of a drag does, is no step of its own.
  apply(document, what, joins = null) {
    if (document === this.now) return;
    const last = this.past[this.past.length - 1];
    if (!(joins !== null && last && last.joins === joins && this.future.length === 0))
      this.past.push({ document: this.now, what, joins });
    if (this.past.length > kMost) this.past.shift();
    this.future = [];
    this.now = document;
    this.tell("change");
  }

  // What comes next is a step of its own.
  seal() {
    const last = this.past[this.past.length - 1];
    if (last) last.joins = null;
  }

  // Which specimens are shown is saved, and no step.
  show(document) {
    this.now = document;
    this.tell("show");
  }

  // Changes every document alike, which is no step: a picture was added.
  rebase(change) {
    const changed = entry => ({ ...entry, document: change(entry.document) });
    this.past = this.past.map(changed);
    this.future = this.future.map(changed);
    this.now = change(this.now);
    this.tell("reset");
  }

  // The server's: another window's. A new beginning.
  reset(document) {
    this.past = [];
    this.future = [];
    this.now = document;
    this.tell("reset");
  }

  get undoes() { return this.past.length ? this.past[this.past.length - 1].what : null; }
  get redoes() { return this.future.length ? this.future[this.future.length - 1].what : null; }

  // The specimens that are shown stay, unless the document had fewer.
  step(from, to) {
    const entry = from.pop();
    if (!entry) return false;
    to.push({ document: this.now, what: entry.what, joins: null });
    const shown = this.now.shown.every(i => i < entry.document.specimens.length) ? this.now.shown : entry.document.shown;
    this.now = { ...entry.document, shown };
    this.tell("change");
    return true;
  }

  undo() { return this.step(this.past, this.future); }
  redo() { return this.step(this.future, this.past); }
}
