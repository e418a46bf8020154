// The page on which pairs are picked: what its buttons and keys do.

import { keep } from './save.js';
import { drawMarks } from './pick_marks.js';
import { Pairs, colourOf, complete, read, written } from './pick_pairs.js';
import { Panel } from './pick_panel.js';
import { VIEWS } from './stage.js';

const $ = (id) => document.getElementById(id);
const make = (name, properties, ...children) => {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
};
const SIDES = ['source', 'target'];
/** The most pairs that are listed; a file of `isomorph match` has thousands. */
const LISTED = 300;

const KEYS = [
  ['Click', 'place a point at the nearest vertex'], ['Click a marker', 'choose its pair, to place it anew'], ['Drag', 'turn'],
  ['Right drag, two fingers', 'move'], ['Scroll, pinch', 'zoom'], ['Ctrl+Z, Ctrl+Shift+Z', 'undo, redo'], ['Delete', 'delete the chosen pair'],
  ['Escape', 'give up the chosen pair'], ['Ctrl+S', 'save'], ['M', 'take the name of the other side'], ['1 to 7', 'standard views'], ['+ −', 'zoom'],
  ['L, W, T', 'turn both together, wireframe, light or dark'], ['Arrow keys on a shape', 'turn it'], ['Enter on a shape', 'place a point at the cross'],
];

/** The shapes of the page, with float positions about the middle of their boxes. */
function readShapes() {
  const given = JSON.parse($('shapes').textContent);
  const text = atob($('bytes').textContent.trim());
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
  const kinds = { u16: Uint16Array, u32: Uint32Array };
  const array = (place) => place && new kinds[place.kind](bytes.buffer, place.at, place.count);
  for (const side of SIDES) {
    const { positions, triangles, sides } = given[side];
    given[side].positions = Float32Array.from(array(positions), (whole, k) => whole / 65535 - 0.5 * sides[k % 3]);
    given[side].triangles = array(triangles);
  }
  return given;
}

export function startPicking() {
  const page = readShapes();
  const state = { linked: true, up: 'y', hovered: { source: -1, target: -1 }, ended: false };
  const counts = SIDES.map((side) => page[side].positions.length / 3);
  let dirty = true, resting = 0;
  const redraw = () => { dirty = true; };
  const say = (text) => { $('saved').textContent = text; };

  // ---- pairs
  const pairs = new Pairs(() => { list(); look(); });
  const title = (k) => `pair ${k + 1}${pairs.list[k].name ? ` (${pairs.list[k].name})` : ''}`;
  /** What to do next, in words and as a frame around a shape. */
  const describe = () => {
    const pair = pairs.list[pairs.chosen];
    const wanted = pair ? SIDES.filter((side) => pair[side] === null) : [];
    document.querySelectorAll('.pane').forEach((pane, k) => pane.classList.toggle('wanted', wanted.includes(SIDES[k])));
    if (!pair) $('status').textContent = 'Click a point of the source, then the same place of the target.';
    else if (wanted.length) $('status').textContent = `Now click the same place on the ${wanted[0]}, for ${title(pairs.chosen)}.`;
    else $('status').textContent = `Click anew where ${title(pairs.chosen)} belongs, on either shape.`;
  };
  const row = (pair, k) => {
    const number = make('button', { type: 'button', className: 'number', textContent: k + 1, title: 'Choose', onclick: () => pairs.choose(pairs.chosen === k ? -1 : k) });
    number.style.background = colourOf(k);
    number.setAttribute('aria-label', `Choose ${title(k)}`);
    number.setAttribute('aria-pressed', pairs.chosen === k);
    const name = make('input', { type: 'text', value: pair.name, maxLength: 80, placeholder: 'Name', autocomplete: 'off', ariaLabel: `Name of pair ${k + 1}` });
    name.addEventListener('change', () => pairs.rename(k, name.value.trim()));
    const remove = make('button', { type: 'button', className: 'remove', textContent: '×', title: 'Delete', ariaLabel: `Delete ${title(k)}`, onclick: () => pairs.remove(k) });
    const at = (vertex) => (vertex === null ? '–' : vertex);
    const where = make('span', { className: 'where', textContent: `vertex ${at(pair.source)} → ${at(pair.target)}` });
    const made = make('li', { className: pairs.chosen === k ? 'chosen' : '' }, number, name, remove, where);
    made.dataset.pair = k;
    return made;
  };
  const list = () => {
    const from = Math.max(0, pairs.list.length - LISTED);
    $('pairs').replaceChildren(...pairs.list.slice(from).map((pair, k) => row(pair, from + k)));
    $('earlier').textContent = from ? `Of ${pairs.list.length} pairs the last ${LISTED} are listed.` : '';
    const chosen = $('pairs').querySelector('.chosen') || $('pairs').lastElementChild;
    if (chosen) chosen.scrollIntoView({ block: 'nearest' });
    const whole = pairs.list.filter(complete).length;
    $('count').textContent = whole ? `(${whole})` : '';
    $('undo').disabled = !pairs.past.length;
    $('redo').disabled = !pairs.future.length;
    $('save').textContent = pairs.dirty ? 'Save' : 'Saved';
    const other = pairs.mirrored();
    $('mirror').hidden = !other;
    $('mirror').textContent = other || '';
    $('mirror').title = other ? `Name the next pair "${other}" (M)` : '';
    describe();
    redraw();
  };
  const take_mirror = () => { if (!$('mirror').hidden) $('next').value = $('mirror').textContent; };
  $('mirror').addEventListener('click', take_mirror);
  $('undo').addEventListener('click', () => pairs.undo());
  $('redo').addEventListener('click', () => pairs.redo());

  // ---- both shapes
  const place = (panel, at) => {
    const marker = panel.markerAt(at, pairs.list.map((pair) => pair[panel.side]));
    const pair = pairs.list[pairs.chosen], half = pair && !complete(pair);
    // While a pair waits for its other half, a click is never for another one.
    if (marker >= 0 && !half && marker !== pairs.chosen) return pairs.choose(marker);
    const vertex = panel.vertexAt(at);
    if (vertex < 0) return;
    const begins = pairs.chosen < 0;
    pairs.place(panel.side, vertex, $('next').value.trim());
    if (begins) $('next').value = '';
  };
  const panels = SIDES.map((side, k) => {
    const canvas = $(side), { name } = page[side];
    canvas.setAttribute('aria-label', `The ${side}, ${name}, ${counts[k]} vertices. Arrow keys turn it, Enter places a point at the cross in the middle`);
    canvas.parentElement.querySelector('.caption').textContent = `${side[0].toUpperCase()}${side.slice(1)}: ${name}`;
    const panel = new Panel(canvas, side, page[side], {
      onPick: (at) => place(panel, at),
      onHover: (vertex) => { state.hovered[side] = vertex; redraw(); },
      onTurn: () => {
        if (state.linked) panels.forEach((other) => other !== panel && other.follow(panel));
        look();
        redraw();
      },
    });
    // For tests: where a vertex is on the screen.
    canvas.panel = panel;
    return panel;
  });
  const drawn = panels.map(({ canvas }) => canvas.parentElement.querySelector('.marks'));
  /** What is hidden is found once the picture rests. */
  function look() {
    clearTimeout(resting);
    resting = setTimeout(() => {
      panels.forEach((panel) => panel.lookForHidden(pairs.list.map((pair) => pair[panel.side]).filter((vertex) => vertex !== null)));
      redraw();
    }, 60);
  }
  const view = (name) => { panels.forEach((panel) => panel.look(name, state.up)); look(); redraw(); };
  const active = () => panels.filter(({ canvas }) => canvas === document.activeElement);
  const zoom = (by) => (state.linked || !active().length ? (state.linked ? panels.slice(0, 1) : panels) : active()).forEach((panel) => panel.zoom(by));
  Object.keys(VIEWS).forEach((name, k) => {
    const words = name[0].toUpperCase() + name.slice(1);
    $('views').append(make('button', { id: `view-${name}`, type: 'button', textContent: words, title: `${words} (${k + 1})`, onclick: () => view(name) }));
  });
  $('views').append(make('div', { className: 'pair' },
    make('button', { id: 'zoom-out', type: 'button', textContent: '−', title: 'Zoom out (−)', ariaLabel: 'Zoom out', onclick: () => zoom(1.25) }),
    make('button', { id: 'zoom-in', type: 'button', textContent: '+', title: 'Zoom in (+)', ariaLabel: 'Zoom in', onclick: () => zoom(0.8) })));
  $('up').addEventListener('change', (event) => { state.up = event.target.value; view('oblique'); });
  const link = (on) => {
    $('linked').checked = state.linked = on;
    if (on) { panels[1].follow(panels[0]); look(); redraw(); }
  };
  const wire = (on) => {
    $('wire').checked = on;
    panels.forEach((panel) => { if (panel.wire) panel.wire.visible = on; panel.spoil(); });
    redraw();
  };
  $('wire').disabled = panels.every((panel) => !panel.wire);
  $('linked').addEventListener('change', () => link($('linked').checked));
  $('wire').addEventListener('change', () => wire($('wire').checked));

  // ---- file
  const half = () => (pairs.list.every(complete) ? '' : ' A pair with one point only was left out.');
  const download = () => {
    keep(new Blob([written(pairs.list)], { type: 'text/csv' }), page.output);
    say(`Offered as a download, ${page.output}.${half()}`);
    pairs.saved = pairs.list;
    list();
  };
  const send = async (where, body) => {
    const answer = await fetch(where, { method: 'POST', body, headers: { 'Content-Type': 'text/csv' } });
    const text = await answer.text();
    if (!answer.ok) throw new Error(text);
    return text;
  };
  const gone = (error) => (error instanceof TypeError ? 'isomorph no longer answers. Use Download, and name the file yourself.' : `Not saved: ${error.message}`);
  const save = async () => {
    if (!pairs.list.some(complete)) { say('There is no whole pair to save yet.'); return false; }
    if (!page.served) { download(); return true; }
    const sent = pairs.list;
    try {
      const count = await send('pairs', written(sent));
      pairs.saved = sent;
      say(`Saved ${count} pairs as ${page.output}.${half()}`);
      list();
      return true;
    } catch (error) {
      say(gone(error));
      return false;
    }
  };
  const done = async () => {
    if (pairs.dirty && pairs.list.some(complete) && !(await save())) return;
    try {
      await send('done', '');
    } catch (error) {
      say(gone(error));
      return;
    }
    state.ended = true;
    const text = pairs.saved.some(complete) ? `The pairs are in ${page.output}.` : 'No pairs were saved.';
    document.body.append(make('div', { id: 'ended', textContent: `Done. ${text} You can close this page.`, role: 'alert' }));
  };
  const load = (text) => {
    pairs.change(read(text, counts), -1);
    say(`Loaded ${pairs.list.length} pairs.`);
  };
  $('save').addEventListener('click', save);
  $('download').addEventListener('click', () => (pairs.list.some(complete) ? download() : say('There is no whole pair to save yet.')));
  $('done').hidden = !page.served;
  $('download').hidden = !page.served;
  $('done').addEventListener('click', done);
  $('load').addEventListener('change', async (event) => {
    const [file] = event.target.files;
    if (!file) return;
    try { load(await file.text()); } catch (error) { say(`${file.name}, ${error.message}`); }
    event.target.value = '';
  });
  window.addEventListener('beforeunload', (event) => { if (!state.ended && pairs.dirty && pairs.list.some(complete)) event.preventDefault(); });

  // ---- look
  const theme = (name) => {
    document.documentElement.dataset.theme = name;
    panels.forEach((panel) => panel.theme(name));
    redraw();
  };
  const other = () => theme(document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark');
  $('theme').innerHTML = '<svg viewBox="0 0 16 16" aria-hidden="true"><path d="M8 1a7 7 0 1 0 0 14zm0 0"/></svg>';
  $('theme').addEventListener('click', other);
  $('help').addEventListener('click', () => $('keys').showModal());
  $('keys-list').append(...KEYS.flatMap(([key, words]) => [make('dt', { textContent: key }), make('dd', { textContent: words })]));

  // ---- keys
  const give_up = () => {
    const pair = pairs.list[pairs.chosen];
    if (pair && !complete(pair)) pairs.remove(pairs.chosen);
    else pairs.choose(-1);
  };
  document.addEventListener('keydown', (event) => {
    if ($('keys').open || state.ended || event.altKey) return;
    const key = event.key.toLowerCase(), writing = event.target.matches('input[type=text]');
    const panel = panels.find(({ canvas }) => canvas === event.target);
    const turns = { arrowleft: [-0.1, 0], arrowright: [0.1, 0], arrowup: [0, 0.1], arrowdown: [0, -0.1] };
    if (event.ctrlKey || event.metaKey) {
      if (key === 's') { document.activeElement.blur(); save(); }
      else if (writing) return;
      else if (key === 'y' || (key === 'z' && event.shiftKey)) pairs.redo();
      else if (key === 'z') pairs.undo();
      else return;
    } else if (writing) {
      if (!['enter', 'escape'].includes(key)) return;
      event.target.blur();
    } else if (event.target.tagName === 'SELECT') return;
    else if (panel && turns[key]) panel.turn(...turns[key]);
    else if (panel && key === 'enter') place(panel, { x: panel.width / 2, y: panel.height / 2, kind: 'mouse' });
    else if (key === 'escape') give_up();
    else if ((key === 'delete' || key === 'backspace') && pairs.chosen >= 0) pairs.remove(pairs.chosen);
    else if (/^[1-7]$/.test(key)) view(Object.keys(VIEWS)[Number(key) - 1]);
    else if (key === '+' || key === '=') zoom(0.8);
    else if (key === '-') zoom(1.25);
    else if (key === 'l') link(!state.linked);
    else if (key === 'w' && !$('wire').disabled) wire(!$('wire').checked);
    else if (key === 'm') take_mirror();
    else if (key === 't') other();
    else if (key === '?') $('keys').showModal();
    else return;
    event.preventDefault();
  });

  // ---- begin
  const wish = new URLSearchParams(location.hash.slice(1));
  theme(wish.get('theme') || (matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light'));
  const ratio = () => Math.min(2, devicePixelRatio);
  const fit = () => { panels.forEach((panel) => panel.resize(ratio())); look(); redraw(); };
  panels.forEach(({ canvas }) => new ResizeObserver(fit).observe(canvas));
  fit();
  view('oblique');
  if (page.given !== null) {
    load(page.given);
    // Nothing to take back, and nothing that the file lacks.
    [pairs.past, pairs.saved] = [[], pairs.list];
  } else pairs.saved = pairs.list;
  list();
  $('about').textContent = `Names are kept in the file as comments. ${page.served ? 'This page comes from isomorph on this machine' : 'This page is a file'} and loads nothing. Made by isomorph ${page.version}; drawn with three.js (MIT licence).`;
  const loop = () => {
    if (dirty) {
      dirty = false;
      const dark = document.documentElement.dataset.theme === 'dark';
      panels.forEach((panel, k) => {
        panel.render();
        drawMarks(drawn[k], panel, pairs, state.hovered[panel.side], ratio(), dark);
      });
      document.documentElement.dataset.drawn = Number(document.documentElement.dataset.drawn || 0) + 1;
    }
    requestAnimationFrame(loop);
  };
  requestAnimationFrame(loop);
}
