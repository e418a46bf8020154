// What is computed of a moving mesh from its positions: speed and strain.

/** Speed of each vertex at frame k, from the frames beside it, in lengths of the scene per unit of time. */
export function velocities(track, k) {
  const { frames, times } = track;
  const before = Math.max(0, k - 1), after = Math.min(frames.length - 1, k + 1);
  const out = new Float32Array(frames[k].length);
  const span = times[after] - times[before];
  if (!(span > 0)) return out;
  for (let j = 0; j < out.length; j++) out[j] = (frames[after][j] - frames[before][j]) / span;
  return out;
}

export function lengths(vectors) {
  const out = new Float32Array(vectors.length / 3);
  for (let k = 0; k < out.length; k++) out[k] = Math.hypot(vectors[3 * k], vectors[3 * k + 1], vectors[3 * k + 2]);
  return out;
}

/**
 * Largest relative change of length at each vertex against the first frame, in percent. Of a triangle it is
 * the larger of |s - 1| over its two principal stretches s; a vertex has the mean of its triangles by area.
 */
export function strain(track, k) {
  const { frames, triangles } = track;
  const rest = frames[0], now = frames[k];
  const sum = new Float32Array(rest.length / 3), weight = new Float32Array(rest.length / 3);
  const edge = (x, a, b) => [x[3 * b] - x[3 * a], x[3 * b + 1] - x[3 * a + 1], x[3 * b + 2] - x[3 * a + 2]];
  const dot = (u, v) => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  for (let i = 0; i < triangles.length; i += 3) {
    const [a, b, c] = [triangles[i], triangles[i + 1], triangles[i + 2]];
    const [u, v, p, q] = [edge(rest, a, b), edge(rest, a, c), edge(now, a, b), edge(now, a, c)];
    // First fundamental forms: the stretches are the roots of the eigenvalues of G0^-1 G1.
    const [e, f, g] = [dot(u, u), dot(u, v), dot(v, v)];
    const [E, F, G] = [dot(p, p), dot(p, q), dot(q, q)];
    const det = e * g - f * f;
    if (!(det > 1e-18)) continue;
    const trace = (g * E - 2 * f * F + e * G) / det;
    const product = (E * G - F * F) / det;
    const root = Math.sqrt(Math.max(0, trace * trace / 4 - product));
    const most = Math.sqrt(trace / 2 + root), least = Math.sqrt(Math.max(0, trace / 2 - root));
    const off = 100 * Math.max(Math.abs(most - 1), Math.abs(least - 1)), area = Math.sqrt(det);
    for (const corner of [a, b, c]) {
      sum[corner] += area * off;
      weight[corner] += area;
    }
  }
  for (let j = 0; j < sum.length; j++) sum[j] = weight[j] > 0 ? sum[j] / weight[j] : 0;
  return sum;
}

/** For each point the nearest of other points, found in a grid of cells. */
export function nearest(points, others) {
  const cell = 1 / 24, key = (x, y, z) => ((x + 512) * 1024 + y + 512) * 1024 + z + 512;
  const grid = new Map();
  const at = (x) => Math.floor(x / cell);
  for (let k = 0; k < others.length / 3; k++) {
    const found = key(at(others[3 * k]), at(others[3 * k + 1]), at(others[3 * k + 2]));
    if (!grid.has(found)) grid.set(found, []);
    grid.get(found).push(k);
  }
  const out = new Uint32Array(points.length / 3);
  for (let k = 0; k < out.length; k++) {
    const [x, y, z] = points.subarray(3 * k, 3 * k + 3);
    let best = -1, least = Infinity;
    for (let reach = 0; reach < 30 && (best < 0 || reach <= Math.ceil(Math.sqrt(least) / cell)); reach++) {
      for (let i = -reach; i <= reach; i++) for (let j = -reach; j <= reach; j++) for (let l = -reach; l <= reach; l++) {
        if (Math.max(Math.abs(i), Math.abs(j), Math.abs(l)) !== reach) continue;
        for (const o of grid.get(key(at(x) + i, at(y) + j, at(z) + l)) || []) {
          const d = (others[3 * o] - x) ** 2 + (others[3 * o + 1] - y) ** 2 + (others[3 * o + 2] - z) ** 2;
          if (d < least) { least = d; best = o; }
        }
      }
    }
    out[k] = Math.max(0, best);
  }
  return out;
}

/** The value that all but so many percent lie below. */
export function quantile(arrays, share) {
  const some = [];
  for (const values of arrays) {
    const stride = Math.max(1, Math.floor(values.length / 2000));
    for (let k = 0; k < values.length; k += stride) some.push(values[k]);
  }
  some.sort((a, b) => a - b);
  return some.length ? some[Math.floor(share * (some.length - 1))] : 0;
}
