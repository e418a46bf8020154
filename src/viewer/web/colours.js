// Colours of the scene in both themes, and the scale that values are shown on.

import { Color } from 'three';

export const THEMES = {
  light: { background: 0xf4f3ef, surface: 0x6fa8dc, carried: 0xe8914a, source: 0x1f8a70, target: 0x8a4fc4, ink: 0x22303c, wire: 0x1b2733 },
  dark: { background: 0x14181d, surface: 0x5f9dd6, carried: 0xe08a42, source: 0x3fc5a0, target: 0xb88af0, ink: 0xe8edf2, wire: 0xdfe8f0 },
};

/** From blue over green to yellow: even steps look even, and it reads in grey and by the colour-blind. */
const STOPS = ['#3b2f80', '#31658d', '#21908c', '#5ac864', '#fde725'];
const linear = STOPS.map((stop) => new Color(stop));

/** Writes the colour of a share, 0 to 1, into three places. */
export function paint(out, at, share) {
  const x = Math.min(1, Math.max(0, share)) * (linear.length - 1), k = Math.min(linear.length - 2, Math.floor(x));
  const [a, b] = [linear[k], linear[k + 1]], s = x - k;
  out[at] = a.r + s * (b.r - a.r);
  out[at + 1] = a.g + s * (b.g - a.g);
  out[at + 2] = a.b + s * (b.b - a.b);
}

export const gradient = `linear-gradient(to right, ${STOPS.join(', ')})`;
