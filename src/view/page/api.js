// The program behind the page. Addresses are relative, so that the token of the page's own address is in each.

export class ApiError extends Error {
  constructor(status, message, reply = null) {
    super(message);
    this.status = status;
    this.reply = reply;
  }
}

const send = async (path, options) => {
  let response;
  try {
    response = await fetch(path, { cache: "no-store", ...options });
  } catch {
    throw new ApiError(0, "the program does not answer: it was ended, or is busy");
  }
  if (response.ok) return response;
  const reply = await response.json().catch(() => null);
  throw new ApiError(response.status, reply?.error ?? `the program refused (${response.status})`, reply);
};

const post = (path, body) =>
  send(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });

export const loadState = async () => (await send("state")).json();
export const saveState = async (document, base) => (await post("state", { document, base })).json();
export const judge = async request => (await post("judge", request)).json();
export const exportTo = async name => (await post("export", { name })).json();
export const addPicture = async file =>
  (await send(`picture?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file })).json();
export const end = () => post("end", {});

export const loadPicture = async number => {
  const blob = await (await send(`picture?name=${number}`)).blob();
  return createImageBitmap(blob);
};

// See live_map.hpp: a head of JSON, then numbers.
export const readMap = bytes => {
  const length = new DataView(bytes).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  let at = 4 + length;
  const take = count => {
    const numbers = new Float32Array(bytes, at, count);
    at += 4 * count;
    return numbers;
  };
  const nodes = head.columns * head.rows;
  head.frames = head.times.map(() => take(2 * nodes));
  head.paths = head.times.map(() => take(2 * head.landmarks.length));
  head.jacobians = take(nodes);
  return head;
};

// Null where a quicker request came before.
export const match = async request => {
  const response = await post("match", request);
  return response.status === 204 ? null : readMap(await response.arrayBuffer());
};
