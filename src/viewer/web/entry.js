// The page of a run: what its buttons and keys do.

import { gradient, THEMES } from './colours.js';
import { drawCurves, significant } from './curves.js';
import { readRun, ownTime } from './data.js';
import { startPicking } from './pick.js';
import { canRecord, savePicture, saveVideo } from './save.js';
import { Stage, VIEWS } from './stage.js';

const $ = (id) => document.getElementById(id);
const make = (name, properties, ...children) => {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
};
const icon = (path) => `<svg viewBox="0 0 16 16" aria-hidden="true"><path d="${path}"/></svg>`;
const ICONS = {
  play: icon('M4 2.2v11.6L13.5 8z'),
  pause: icon('M3.5 2h3.2v12H3.5zM9.3 2h3.2v12H9.3z'),
  theme: icon('M8 1a7 7 0 1 0 0 14zm0 0'),
  full: icon('M1 1h5v2H3v3H1zm9 0h5v5h-2V3h-3zM1 10h2v3h3v2H1zm12 0h2v5h-5v-2h3z'),
};

/** What can be shown: its key on the keyboard, its words, the colour that it has, and whether the run has it. */
const SHOWN = {
  surface: { key: 's', words: 'Surface', colour: 'surface', has: (run) => run.surfaces.length > 0 },
  carried: { key: 'c', words: 'Carried source', colour: 'carried', has: (run) => !!run.carried },
  points: { key: 'p', words: 'Input points', colour: 'source', has: () => true },
  pairs: { key: 'l', words: 'Pairs', colour: 'target', has: (run) => !!run.pairs },
  arrows: { key: 'v', words: 'Velocity', colour: 'ink', has: (run) => !!run.carried || run.surfaces.some(({ times }) => times.length > 1) },
  wireframe: { key: 'w', words: 'Wireframe', colour: 'wire', has: () => true },
  beside: { key: 'b', words: 'Side by side', colour: null, has: () => true },
};

const WHERE = { surface: 'Surfaces only. ', both: '' };
const COLOURS = {
  plain: { words: 'One colour', note: '', has: () => true },
  truth: { words: 'Distance to ground truth', where: WHERE.surface, note: 'To the nearest point of the true shape at the time of each surface.' },
  speed: { words: 'Speed', note: 'How fast each point moves, from its positions at the times beside.', per: true, has: (run) => SHOWN.arrows.has(run) },
  strain: { words: 'Strain', note: 'Largest change of length around a point against the source, in percent.', percent: true, has: (run) => !!(run.carried && run.carried.triangles) },
  consistency: { words: 'Trust: surface against motion', where: WHERE.surface, note: 'How far a point, moved to the ends, misses the surfaces there. 0 where surface and motion agree.' },
  round_trip: { words: 'Trust: round-trip error', where: WHERE.surface, note: 'How far a point, moved to the ends and back, misses itself: the error of the integrator.' },
};

const KEYS = [
  ['Space', 'play or pause'], ['← →', 'one step back or forth'], ['Home, End', 'source, target'], ['S C P L V W B', 'show or hide, as underlined'],
  ['1 to 7', 'standard views'], ['+ −', 'zoom'], ['T, F', 'light or dark, full screen'],
  ['Drag', 'turn'], ['Right drag', 'move'], ['Scroll', 'zoom'], ['Arrow keys on the picture', 'turn'],
];

function start() {
  const run = readRun();
  const canvas = $('canvas');
  const wish = new URLSearchParams(location.hash.slice(1));
  const state = { t: 0, show: new Set(['surface']), colour: 'plain', playing: false, forth: true, busy: false, speed: 1 };
  if (!run.surfaces.length) state.show = new Set([run.carried ? 'carried' : 'points']);
  const stage = new Stage(canvas, run);
  let dirty = true;
  const redraw = () => { dirty = true; };
  stage.onTurn = redraw;

  // ---- time
  const named = (t) => `t = ${ownTime(run, t)}`;
  const set = (t) => {
    state.t = Math.min(1, Math.max(0, t));
    $('time').value = state.t;
    $('time').setAttribute('aria-valuetext', named(state.t));
    $('now').textContent = named(state.t);
    describe();
    redraw();
  };
  const play = (on) => {
    state.playing = on;
    $('play').innerHTML = on ? ICONS.pause : ICONS.play;
    $('play').setAttribute('aria-label', on ? 'Pause' : 'Play');
    if (on && state.t >= 1) state.forth = false;
    if (on && state.t <= 0) state.forth = true;
    redraw();
  };
  const describe = () => {
    const words = [];
    if (state.show.has('surface')) {
      const { time } = run.surfaces[stage.nearestSurface(state.t)];
      const moved = Math.abs(time - state.t) > 5e-4;
      words.push(`Surface found at t = ${Number(ownTime(run, time))}${moved ? (run.moves ? ', moved to now by the motion' : '') : ''}`);
    }
    if (state.show.has('carried')) words.push(run.carried.triangles ? 'Source mesh carried by the motion' : 'Source points carried by the motion');
    const text = words.join('. ');
    if ($('found').textContent !== text) $('found').textContent = text;
    const nearest = run.surfaces.length ? stage.nearestSurface(state.t) : -1;
    document.querySelectorAll('#quality tbody tr').forEach((row, k) => row.classList.toggle('now', k === nearest));
  };
  $('time').addEventListener('input', (event) => { play(false); set(Number(event.target.value)); });
  $('play').addEventListener('click', () => play(!state.playing));
  $('speed').addEventListener('change', (event) => { state.speed = Number(event.target.value); });
  for (const { time } of run.surfaces) {
    const tick = make('i', { title: `surface at t = ${Number(ownTime(run, time))}` });
    tick.style.left = `${100 * time}%`;
    $('ticks').append(tick);
  }
  for (const time of run.keys) {
    const tick = make('i', { className: 'key', title: `key frame at t = ${Number(ownTime(run, time))}` });
    tick.style.left = `${100 * time}%`;
    $('ticks').append(tick);
  }

  // ---- what is shown
  const toggle = (name) => {
    if (!SHOWN[name].has(run)) return;
    state.show.has(name) ? state.show.delete(name) : state.show.add(name);
    $(`show-${name}`).setAttribute('aria-pressed', state.show.has(name));
    besides();
    describe();
    redraw();
  };
  const besides = () => {
    const on = state.show.has('beside');
    document.body.classList.toggle('beside', on);
    const name = (text) => make('span', { textContent: text });
    $('panels').replaceChildren(...(on ? [name(`Source: ${run.source.name}`), name('Now'), name(`Target: ${run.target.name}`)] : []));
  };
  for (const [name, { key, words, has }] of Object.entries(SHOWN)) {
    const at = words.toLowerCase().indexOf(key);
    const text = at < 0 ? [words] : [words.slice(0, at), make('u', { textContent: words[at] }), words.slice(at + 1)];
    const button = make('button', { id: `show-${name}`, type: 'button', title: `${words} (${key.toUpperCase()})`, disabled: !has(run), onclick: () => toggle(name) }, make('i', {}), make('span', {}, ...text));
    button.setAttribute('aria-pressed', state.show.has(name));
    button.setAttribute('aria-keyshortcuts', key.toUpperCase());
    $('show').append(button);
  }

  // ---- colour
  const scale = () => {
    const { words, per, percent, where, note } = COLOURS[state.colour];
    const is_plain = state.colour === 'plain';
    $('scale').hidden = is_plain;
    $('colour-note').textContent = is_plain ? '' : (where || '') + note;
    if (is_plain) return;
    const most = stage.scaleOf(state.colour);
    $('scale-name').textContent = words;
    $('scale-bar').style.background = gradient;
    $('scale-most').textContent = percent ? `${significant(most)} %` : `${significant(most * (['speed'].includes(state.colour) ? run.span / (run.clock[1] - run.clock[0]) : 1))} ${per ? 'lengths / time' : 'lengths'}`;
  };
  for (const [name, { words, has }] of Object.entries(COLOURS)) {
    const is_there = has ? has(run) : run.surfaces.some(({ values }) => values[name]);
    if (is_there) $('colour').append(make('option', { value: name, textContent: words }));
  }
  const colour = (name) => { state.colour = name; $('colour').value = name; scale(); redraw(); };
  $('colour').addEventListener('change', (event) => colour(event.target.value));

  // ---- view
  Object.keys(VIEWS).forEach((name, k) => {
    const words = name[0].toUpperCase() + name.slice(1);
    $('views').append(make('button', { id: `view-${name}`, type: 'button', textContent: words, title: `${words} (${k + 1})`, onclick: () => { stage.look(name); redraw(); } }));
  });
  $('views').append(make('span', { className: 'pair' },
    make('button', { id: 'zoom-out', type: 'button', textContent: '−', title: 'Zoom out (−)', ariaLabel: 'Zoom out', onclick: () => stage.zoom(1.25) }),
    make('button', { id: 'zoom-in', type: 'button', textContent: '+', title: 'Zoom in (+)', ariaLabel: 'Zoom in', onclick: () => stage.zoom(0.8) })));
  $('up').addEventListener('change', (event) => { stage.up = event.target.value; stage.look('oblique'); redraw(); });
  const theme = (name) => {
    document.documentElement.dataset.theme = name;
    stage.theme(name);
    for (const [shown, { colour: which }] of Object.entries(SHOWN)) {
      if (which) $(`show-${shown}`).style.setProperty('--swatch', `#${THEMES[name][which].toString(16).padStart(6, '0')}`);
    }
    redraw();
  };
  const other = () => theme(document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark');
  const full = () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen());
  $('theme').innerHTML = ICONS.theme;
  $('theme').addEventListener('click', other);
  $('fullscreen').innerHTML = ICONS.full;
  $('fullscreen').addEventListener('click', full);
  $('help').addEventListener('click', () => $('keys').showModal());
  $('keys-list').append(...KEYS.flatMap(([key, words]) => [make('dt', { textContent: key }), make('dd', { textContent: words })]));

  // ---- save
  const draw = () => { stage.set(state.t, state); stage.render(); };
  const name = run.title.replace(/[^\w.-]+/g, '-');
  $('picture').addEventListener('click', async () => {
    draw();
    const bytes = await savePicture(canvas, `${name}-t${state.t.toFixed(3)}`);
    $('saved').textContent = `Picture saved, ${Math.round(bytes / 1000)} kB.`;
  });
  $('video').disabled = !canRecord(canvas);
  if ($('video').disabled) $('video').title = 'This browser cannot record a canvas';
  $('video').addEventListener('click', async () => {
    const before = state.t;
    play(false);
    $('video').disabled = state.busy = true;
    $('saved').textContent = 'Recording from t = 0 to t = 1.';
    try {
      const bytes = await saveVideo(canvas, name, 4 / state.speed, (t) => { set(t); draw(); });
      $('saved').textContent = `Video saved, ${(bytes / 1e6).toFixed(1)} MB.`;
    } catch (error) {
      $('saved').textContent = `The video could not be recorded: ${error.message}`;
    }
    $('video').disabled = state.busy = false;
    set(before);
  });

  // ---- keys
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || $('keys').open) return;
    const field = event.target.closest && event.target.closest('input, select, textarea, pre, button, summary');
    const on_canvas = event.target === canvas, key = event.key.toLowerCase();
    const shown = Object.entries(SHOWN).find(([, one]) => one.key === key);
    const step = event.shiftKey ? 0.1 : 0.01;
    const arrows = { arrowleft: [-0.1, 0], arrowright: [0.1, 0], arrowup: [0, 0.1], arrowdown: [0, -0.1] };
    if (field && (field.tagName === 'SELECT' || ([' ', 'enter'].includes(key) && field.tagName !== 'INPUT'))) return;
    if (on_canvas && arrows[key]) stage.turn(...arrows[key]);
    else if (key === ' ') play(!state.playing);
    else if (key === 'arrowleft' || key === 'arrowright') { play(false); set(state.t + (key === 'arrowleft' ? -step : step)); }
    else if (key === 'home' || key === 'end') { play(false); set(key === 'home' ? 0 : 1); }
    else if (shown) toggle(shown[0]);
    else if (/^[1-7]$/.test(key)) { stage.look(Object.keys(VIEWS)[Number(key) - 1]); redraw(); }
    else if (key === '+' || key === '=') stage.zoom(0.8);
    else if (key === '-') stage.zoom(1.25);
    else if (key === 't') other();
    else if (key === 'f') full();
    else if (key === '?') $('keys').showModal();
    else return;
    event.preventDefault();
  });

  // ---- results
  results(run);

  // ---- begin
  theme(wish.get('theme') || (matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light'));
  if (wish.has('show')) wish.get('show').split(',').concat([...state.show]).forEach((one) => {
    const wanted = wish.get('show').split(',').includes(one);
    if (SHOWN[one] && wanted !== state.show.has(one)) toggle(one);
  });
  colour([...$('colour').options].some(({ value }) => value === wish.get('colour')) ? wish.get('colour') : 'plain');
  new ResizeObserver(() => {
    stage.resize(canvas.clientWidth, canvas.clientHeight, Math.min(2, devicePixelRatio));
    redraw();
  }).observe(canvas);
  stage.resize(canvas.clientWidth, canvas.clientHeight, Math.min(2, devicePixelRatio));
  stage.aspect = canvas.clientWidth / canvas.clientHeight;
  stage.look(VIEWS[wish.get('view')] ? wish.get('view') : 'oblique');
  set(Number(wish.get('t')) || 0);
  const still = wish.has('t') || matchMedia('(prefers-reduced-motion: reduce)').matches;
  play(!still);
  let last = performance.now(), rest = 0;
  const loop = (now) => {
    const passed = Math.min(0.1, (now - last) / 1000);
    last = now;
    if (state.playing && !state.busy) {
      rest = Math.max(0, rest - passed);
      const t = state.t + (rest ? 0 : ((state.forth ? 1 : -1) * passed * state.speed) / 4);
      // There and back, with a rest at each end.
      if (t >= 1 || t <= 0) { state.forth = t <= 0; rest = 0.5; }
      set(t);
    }
    if (dirty && !state.busy) { dirty = false; draw(); document.documentElement.dataset.drawn = Number(document.documentElement.dataset.drawn || 0) + 1; }
    requestAnimationFrame(loop);
  };
  requestAnimationFrame(loop);
}

/** Tables, curves and texts beside the picture. */
function results(run) {
  $('subtitle').textContent = run.subtitle;
  const columns = [['time', 't'], ['triangles', 'triangles'], ['components', 'pieces'], ['consistency', 'consistency'], ['round_trip', 'round trip'], ['slope_error', 'slope error'], ['truth', 'to truth']];
  const is_said = (row, name) => row[name] !== undefined && row[name] !== null;
  // Pieces are worth a column where there is more than one.
  const used = columns.filter(([name]) => run.quality.some((row) => is_said(row, name) && !(name === 'components' && row[name] === 1)));
  const text = (value) => (value === undefined || value === null ? '–' : Number.isInteger(value) ? value.toLocaleString('en') : significant(value, 2));
  const cell = (value, name) => make('td', { textContent: name === 'time' ? String(Number(value.toPrecision(6))) : text(value) });
  if (run.quality.length) {
    const head = make('tr', {}, ...used.map(([, words]) => make('th', { textContent: words, scope: 'col' })));
    const rows = run.quality.map((row) => make('tr', {}, ...used.map(([name]) => cell(row[name], name))));
    $('quality').append(make('table', {}, make('thead', {}, head), make('tbody', {}, ...rows)));
    $('quality').append(make('p', { className: 'note', textContent: 'Consistency, round trip and distance to truth are means in normalised lengths, in which the shapes have the area 1. Small is good.' }));
  } else $('quality').append(make('p', { className: 'note', textContent: 'The run has no surfaces yet: isomorph extract writes them.' }));
  drawCurves($('curves'), run.training);
  if (run.notes.length) {
    $('notes-section').hidden = false;
    $('notes').append(...run.notes.map((text) => make('li', { textContent: text })));
  }
  $('recipe').textContent = run.recipe;
  const size = (document.getElementById('bytes').textContent.length + document.scripts[document.scripts.length - 1].textContent.length) / 1e6;
  $('about').textContent = `${run.thinned.length ? `Shown with fewer points than the files have: ${run.thinned.join('; ')}. ` : ''}Positions are rounded to ${significant(run.span / 65535)} lengths. This page has ${size.toFixed(1)} MB and loads nothing. Made by isomorph ${run.version} on ${run.date}; drawn with three.js (MIT licence).`;
}

try {
  // Two pages have this one program; each holds its own data.
  if ($('shapes')) startPicking(); else start();
} catch (error) {
  console.error(error);
  const text = `The picture cannot be drawn: ${error.message}. The page needs WebGL 2, which most browsers have; look whether it is switched off.`;
  document.querySelector('.view').append(make('div', { id: 'failed', textContent: text }));
}
