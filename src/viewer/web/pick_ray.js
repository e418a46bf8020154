// Which vertex is under the pointer: exact numbers of the file, whatever the picture shows.

/** The first triangle that a ray meets, and how far along it; null where it meets none. */
export function firstTriangle(positions, triangles, origin, along) {
  const [ox, oy, oz] = origin, [dx, dy, dz] = along;
  let best = Infinity, found = -1;
  for (let k = 0; k < triangles.length; k += 3) {
    const a = 3 * triangles[k], b = 3 * triangles[k + 1], c = 3 * triangles[k + 2];
    const ax = positions[a], ay = positions[a + 1], az = positions[a + 2];
    const ux = positions[b] - ax, uy = positions[b + 1] - ay, uz = positions[b + 2] - az;
    const vx = positions[c] - ax, vy = positions[c + 1] - ay, vz = positions[c + 2] - az;
    // Cramer's rule for origin + t along = a + p u + q v.
    const px = dy * vz - dz * vy, py = dz * vx - dx * vz, pz = dx * vy - dy * vx;
    const volume = ux * px + uy * py + uz * pz;
    if (volume === 0) continue;
    const sx = ox - ax, sy = oy - ay, sz = oz - az;
    const p = (sx * px + sy * py + sz * pz) / volume;
    if (p < 0 || p > 1) continue;
    const qx = sy * uz - sz * uy, qy = sz * ux - sx * uz, qz = sx * uy - sy * ux;
    const q = (dx * qx + dy * qy + dz * qz) / volume;
    if (q < 0 || p + q > 1) continue;
    const t = (vx * qx + vy * qy + vz * qz) / volume;
    if (t > 1e-6 && t < best) [best, found] = [t, k];
  }
  return found < 0 ? null : { triangle: found, distance: best };
}

/** The corner of that triangle nearest to where the ray meets it; -1 where it meets none. */
export function cornerAt(positions, triangles, origin, along) {
  const met = firstTriangle(positions, triangles, origin, along);
  if (!met) return -1;
  const place = [0, 1, 2].map((axis) => origin[axis] + met.distance * along[axis]);
  let best = Infinity, found = -1;
  for (const vertex of triangles.subarray(met.triangle, met.triangle + 3)) {
    const apart = Math.hypot(...place.map((x, axis) => positions[3 * vertex + axis] - x));
    if (apart < best) [best, found] = [apart, vertex];
  }
  return found;
}

/**
 * The point of a cloud nearest to a place on the screen among those in front; -1 where none is within `reach` pixels.
 * `matrix` has the 16 numbers of the projection, by columns; `x`, `y`, `width` and `height` are in pixels.
 */
export function pointAt(positions, matrix, { x, y, width, height }, reach, layer) {
  const near = [];
  let front = Infinity;
  for (let k = 0; k < positions.length; k += 3) {
    const [a, b, c] = [positions[k], positions[k + 1], positions[k + 2]];
    const depth = matrix[3] * a + matrix[7] * b + matrix[11] * c + matrix[15];
    if (depth <= 0) continue;
    const right = (0.5 + (0.5 * (matrix[0] * a + matrix[4] * b + matrix[8] * c + matrix[12])) / depth) * width - x;
    const down = (0.5 - (0.5 * (matrix[1] * a + matrix[5] * b + matrix[9] * c + matrix[13])) / depth) * height - y;
    const apart = right * right + down * down;
    if (apart > reach * reach) continue;
    near.push([apart, depth, k / 3]);
    front = Math.min(front, depth);
  }
  let best = Infinity, found = -1;
  for (const [apart, depth, vertex] of near) if (depth < front + layer && apart < best) [best, found] = [apart, vertex];
  return found;
}
