// The terms of the objective over the steps, as one drawing with a logarithmic axis.

const HUES = ['#d1495b', '#2e86ab', '#3b9b6d', '#8e6bbf', '#c98a1b', '#4f7d9e', '#a05195', '#6b8e23', '#b5651d', '#607d8b', '#008080'];

const element = (name, attributes, ...children) => {
  const made = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
};

export function drawCurves(place, { steps, series }) {
  const named = Object.entries(series).filter(([, values]) => values.some((x) => x > 0));
  if (!named.length || steps.length < 2) {
    place.textContent = 'The run has logged fewer than two steps.';
    return;
  }
  const [width, height, left, bottom, top] = [340, 210, 44, 26, 8];
  const all = named.flatMap(([, values]) => values.filter((x) => x > 0)).map(Math.log10);
  const high = Math.ceil(Math.max(...all)), low = Math.max(Math.floor(Math.min(...all)), high - 8);
  const x = (step) => left + ((step - steps[0]) / (steps[steps.length - 1] - steps[0])) * (width - left - 8);
  const y = (value) => top + ((high - Math.log10(value)) / Math.max(1, high - low)) * (height - top - bottom);
  const drawing = element('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': `Terms of the objective over ${steps.length} logged steps, logarithmic` });
  for (let k = low; k <= high; k += Math.max(1, Math.ceil((high - low) / 6))) {
    const at = y(10 ** k);
    drawing.append(element('line', { x1: left, x2: width - 8, y1: at, y2: at, class: 'grid' }));
    drawing.append(element('text', { x: left - 6, y: at + 3.5, class: 'tick end' }, k === 0 ? '1' : k > 0 && k < 4 ? String(10 ** k) : k < 0 && k > -3 ? String(10 ** k) : `1e${k}`));
  }
  for (const share of [0, 0.5, 1]) {
    const step = Math.round(steps[0] + share * (steps[steps.length - 1] - steps[0]));
    drawing.append(element('text', { x: x(step), y: height - 9, class: `tick ${share === 0 ? '' : share === 1 ? 'end' : 'middle'}` }, `${share === 0.5 ? '' : 'step '}${step}`));
  }
  const legend = document.createElement('ul');
  legend.className = 'legend';
  named.forEach(([name, values], k) => {
    const is_total = name === 'total', colour = is_total ? 'currentColor' : HUES[k % HUES.length];
    const points = steps.map((step, j) => (values[j] > 0 ? `${x(step).toFixed(1)},${y(Math.max(values[j], 10 ** low)).toFixed(1)}` : '')).filter(Boolean);
    drawing.append(element('polyline', { points: points.join(' '), fill: 'none', stroke: colour, 'stroke-width': is_total ? 2 : 1.4, 'stroke-linejoin': 'round' }, element('title', {}, name)));
    const entry = document.createElement('li');
    const key = document.createElement('i');
    key.style.background = colour;
    const last = [...values].reverse().find((value) => value !== null);
    entry.append(key, `${name} `, Object.assign(document.createElement('b'), { textContent: significant(last) }));
    legend.append(entry);
  });
  place.replaceChildren(drawing, legend);
}

/** So many significant digits. */
export function significant(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return 'none';
  if (value === 0) return '0';
  const size = Math.abs(value);
  return size >= 1e-4 && size < 1e6 ? String(Number(value.toPrecision(digits))) : value.toExponential(1);
}
