// The data of the run, which the page holds: a description as JSON, and one block of bytes as base64.

const KINDS = { u8: Uint8Array, u16: Uint16Array, u32: Uint32Array };

export function readRun() {
  const run = JSON.parse(document.getElementById('run').textContent);
  const text = atob(document.getElementById('bytes').textContent.trim());
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
  const array = (place) => place && new KINDS[place.kind](bytes.buffer, place.at, place.count);
  const { low, span } = run.box;
  // Coordinates of the scene: the middle of the box is the origin and its longest side is 1.
  const middle = [0, 1, 2].map((axis) => 0.5 * run.box.sides[axis] / span);
  const positions = (place) => {
    const whole = array(place);
    const out = new Float32Array(whole.length);
    for (let k = 0; k < whole.length; k++) out[k] = whole[k] / 65535 - middle[k % 3];
    return out;
  };
  const shape = (given) => given && { ...given, positions: positions(given.positions), triangles: array(given.triangles) };
  // Positions at several times, one after the other.
  const track = (given) => {
    if (!given) return null;
    const all = positions(given.positions);
    const size = all.length / given.times.length;
    const frames = given.times.map((_, k) => all.subarray(k * size, (k + 1) * size));
    const values = {};
    for (const [name, { place, most }] of Object.entries(given.values || {})) {
      values[name] = Float32Array.from(array(place), (x) => (x / 255) * most);
    }
    return { ...given, positions: null, frames, triangles: array(given.triangles), values };
  };
  return {
    ...run,
    low,
    span,
    source: shape(run.source),
    target: shape(run.target),
    carried: track(run.carried),
    surfaces: run.surfaces.map(track),
    pairs: run.pairs && positions(run.pairs),
  };
}

/** Where a time lies between the times of a track: the frame before and the share of the way to the next. */
export function place(times, t) {
  let k = 0;
  while (k < times.length - 2 && times[k + 1] <= t) k++;
  if (times.length < 2) return [0, 0, 0];
  const share = (t - times[k]) / (times[k + 1] - times[k]);
  return [k, k + 1, Math.min(1, Math.max(0, share))];
}

/** Writes what lies between two frames. */
export function blend(out, frames, [a, b, share]) {
  const [from, to] = [frames[a], frames[b]];
  for (let k = 0; k < out.length; k++) out[k] = from[k] + share * (to[k] - from[k]);
}

/** A time of the page, 0 to 1, as the run counts: with three decimals, fewer where times are large. */
export function ownTime(run, t) {
  const [first, last] = run.clock;
  const length = Math.abs(last - first);
  const digits = Math.min(3, Math.max(0, 3 - Math.floor(Math.log10(length))));
  return (first + t * (last - first)).toFixed(digits);
}
