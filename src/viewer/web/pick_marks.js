// Numbered markers of the pairs, drawn over a panel.

import { colourOf } from './pick_pairs.js';

const RADIUS = 10;

/** Draws each pair's vertex on this side: faint where the surface hides it, with a ring where it is chosen. */
export function drawMarks(marks, panel, pairs, hovered, ratio, dark) {
  const context = marks.getContext('2d');
  [marks.width, marks.height] = [panel.width, panel.height].map((side) => Math.round(side * ratio));
  context.scale(ratio, ratio);
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  const [paper, ink] = dark ? ['#14181d', '#e8edf2'] : ['#fffefb', '#22303c'];
  const disc = ({ x, y }, radius, fill, edge, width) => {
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    if (fill) { context.fillStyle = fill; context.fill(); }
    context.lineWidth = width;
    context.strokeStyle = edge;
    context.stroke();
  };
  const order = pairs.list.map((_, k) => k).filter((k) => pairs.list[k][panel.side] !== null);
  // Hidden ones first, so that they cover nothing, and the chosen one last.
  const rank = (k) => (k === pairs.chosen ? 2 : panel.hidden.has(pairs.list[k][panel.side]) ? 0 : 1);
  order.sort((a, b) => rank(a) - rank(b) || a - b);
  for (const k of order) {
    const vertex = pairs.list[k][panel.side], place = panel.project(vertex);
    context.globalAlpha = rank(k) === 0 ? 0.28 : 1;
    // The disc stands beside its vertex, which stays in sight.
    const beside = { x: place.x + 13, y: place.y - 13 };
    disc(place, 3.5, colourOf(k), paper, 1.5);
    disc(beside, RADIUS, colourOf(k), k === pairs.chosen ? ink : paper, k === pairs.chosen ? 3 : 1.5);
    context.fillStyle = '#fff';
    context.font = `600 ${k < 99 ? 11 : 9}px system-ui, sans-serif`;
    context.fillText(String(k + 1), beside.x, beside.y + 0.5);
  }
  context.globalAlpha = 1;
  if (hovered >= 0) disc(panel.project(hovered), 6, null, ink, 2);
}
