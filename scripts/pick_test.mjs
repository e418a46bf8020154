// Picks pairs in headless Chromium, on the page that `isomorph pick` offers, and holds the file against the clicks.
//
//   node scripts/pick_test.mjs ISOMORPH [FOLDER FOR PICTURES]
//
// Points are placed by mouse, finger and keys, undone, placed anew, deleted, named, saved and loaded. Each vertex in the
// file is the one that was clicked. Done ends the command. The page in a file saves by download.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

import { mirror, read, written } from '../src/viewer/web/pick_pairs.js';
import { check, conclude, launch } from './browser.mjs';

const [program, pictures] = process.argv.slice(2);
const fox = fileURLToPath(new URL('../data/fox/', import.meta.url));
const place = fs.mkdtempSync(path.join(os.tmpdir(), 'isomorph-pick-'));
const pairsFile = path.join(place, 'pairs.csv');
const shapes = [path.join(fox, 'source.ply'), path.join(fox, 'target.ply')];

/** Starts the command; its address, and a promise of how it ends. */
async function offered(...more) {
  const child = spawn(path.resolve(program), ['pick', ...shapes, '-o', pairsFile, '--no-browser', ...more]);
  const said = { out: '', error: '' };
  child.stdout.on('data', (bytes) => { said.out += bytes; });
  child.stderr.on('data', (bytes) => { said.error += bytes; });
  const ended = new Promise((done) => { child.on('exit', (code) => done({ code, ...said })); });
  while (!said.out.includes('\n')) {
    assert(child.exitCode === null, said.error);
    await new Promise((done) => setTimeout(done, 50));
  }
  return { address: said.out.split('\n')[0], ended, child };
}

await check('left and right are exchanged in names', async () => {
  const names = { 'Left ear': 'Right ear', 'front leg, RIGHT': 'front leg, LEFT', hand_l: 'hand_r', 'eye.R': 'eye.L', 'left of left': 'right of right' };
  for (const [name, other] of Object.entries(names)) assert.equal(mirror(name), other);
  for (const name of ['', 'nose', 'leftover', 'bright', 'tail']) assert.equal(mirror(name), null, name);
});
await check('a file that is written is read again', async () => {
  const pairs = [
    { source: 1, target: 2, name: 'nose', confidence: 0.25 },
    { source: 3, target: 4, name: '', confidence: null },
  ];
  assert.deepEqual(read(written(pairs), [5, 5]), [pairs[0], { ...pairs[1], confidence: 1 }]);
  assert.deepEqual(read('\ufeffa, b\r\n# x\r\n +1 , 2\r\n\r\n', [5, 5]).map(({ source, target }) => [source, target]), [[1, 2]]);
  for (const bad of ['1', '1,2,', '1,2,1.5', '1,2,0.5,1', '1;2', '-1,2', '1.5,2', '5,1', 'a\nb']) assert.throws(() => read(`0,0\n${bad}\n`, [5, 5]), /line 2/, bad);
});

const browser = await launch();
const children = [];
try {
  const page = await browser.newPage();
  const [said, asked] = [[], []];
  page.on('console', (message) => said.push(`${message.type()}: ${message.text()}`));
  page.on('pageerror', (error) => said.push(error.message));
  page.on('request', (request) => asked.push(request.url()));
  page.on('dialog', (dialog) => dialog.accept());
  const session = await page.createCDPSession();
  await session.send('Browser.setDownloadBehavior', { behavior: 'allow', downloadPath: place });

  const open = async (address) => {
    await page.goto(address);
    await page.waitForFunction(() => Number(document.documentElement.dataset.drawn) > 0, { timeout: 60000 });
  };
  const keep = (name) => pictures && fs.mkdirSync(pictures, { recursive: true }) !== null && page.screenshot({ path: path.join(pictures, `${name}.png`) });
  const rows = () => page.$$eval('#pairs .where', (all) => all.map(({ textContent }) => textContent));
  const text = (id) => page.$eval(`#${id}`, (one) => one.textContent);
  const says = (id, words) => page.waitForFunction((id, words) => document.getElementById(id).textContent.includes(words), { timeout: 20000 }, id, words);
  // Some vertices of a side that are in sight and apart from each other, with their places on the screen.
  const inSight = (side, wanted) => page.evaluate((side, wanted) => {
    const { panel } = document.getElementById(side), box = panel.canvas.getBoundingClientRect();
    const before = panel.hidden;
    panel.lookForHidden(Array.from({ length: panel.count }, (_, k) => k));
    const found = [];
    for (let k = 0; k < panel.count && found.length < wanted; k += 37) {
      const { x, y } = panel.project(k);
      const is_apart = found.every((other) => Math.hypot(other.x - box.left - x, other.y - box.top - y) > 40);
      if (!panel.hidden.has(k) && is_apart && panel.vertexAt({ x, y, kind: 'mouse' }) === k) found.push({ vertex: k, x: x + box.left, y: y + box.top });
    }
    panel.hidden = before;
    return found;
  }, side, wanted);
  const click = ({ x, y }) => page.mouse.click(x, y);
  const pair = async (one, other) => { await click(one); await click(other); };
  const line = (one, other) => `${one.vertex},${other.vertex}`;

  const { address, ended, child } = await offered();
  children.push(child);
  await open(address);
  const [a, b] = [await inSight('source', 6), await inSight('target', 6)];
  await check('vertices are in sight', async () => assert(a.length === 6 && b.length === 6, `${a.length} and ${b.length}`));
  await check('a click on each shape makes a pair of these vertices', async () => {
    await click(a[0]);
    assert.deepEqual(await rows(), [`vertex ${a[0].vertex} → –`]);
    assert.match(await text('status'), /Now click the same place on the target/);
    await click(b[0]);
    assert.deepEqual(await rows(), [`vertex ${a[0].vertex} → ${b[0].vertex}`]);
    await click(b[1]);
    assert.match(await text('status'), /on the source/);
    await click(a[1]);
    assert.deepEqual((await rows())[1], `vertex ${a[1].vertex} → ${b[1].vertex}`);
  });
  await check('undo and redo go click by click', async () => {
    const both = await rows();
    const press = async (...keys) => { for (const key of keys.slice(0, -1)) await page.keyboard.down(key); await page.keyboard.press(keys.at(-1)); for (const key of keys.slice(0, -1)) await page.keyboard.up(key); };
    await press('Control', 'z');
    assert.deepEqual((await rows())[1], `vertex – → ${b[1].vertex}`);
    await press('Control', 'z');
    assert.equal((await rows()).length, 1);
    await press('Control', 'Shift', 'z');
    await press('Control', 'y');
    assert.deepEqual(await rows(), both);
    await page.click('#undo');
    await page.click('#redo');
    assert.deepEqual(await rows(), both);
  });
  await check('turning is no click, and views stay together', async () => {
    const before = await rows();
    await page.mouse.move(a[2].x, a[2].y);
    await page.mouse.down();
    await page.mouse.move(a[2].x + 60, a[2].y + 10, { steps: 3 });
    await page.mouse.up();
    assert.deepEqual(await rows(), before);
    const cameras = () => page.$$eval('#source, #target', (all) => all.map(({ panel }) => panel.camera.position.toArray().map((x) => x.toFixed(6)).join()));
    const turned = await cameras();
    assert.equal(turned[0], turned[1]);
    await page.click('#linked');
    await page.focus('#source');
    await page.keyboard.press('ArrowLeft');
    const apart = await cameras();
    assert(apart[0] !== turned[0] && apart[1] === turned[1], apart.join(' '));
    await page.click('#linked');
    await page.click('#view-oblique');
  });
  await check('a pair is chosen and placed anew, and another deleted', async () => {
    await pair(a[2], b[2]);
    await page.click('#pairs li:nth-child(1) .number');
    await click(a[3]);
    assert.equal((await rows())[0], `vertex ${a[3].vertex} → ${b[0].vertex}`);
    await page.click('#pairs li:nth-child(2) .remove');
    assert.deepEqual(await rows(), [`vertex ${a[3].vertex} → ${b[0].vertex}`, `vertex ${a[2].vertex} → ${b[2].vertex}`]);
    // A click on a marker chooses its pair, and Delete deletes it; what was deleted comes back.
    await click(a[2]);
    assert.match(await text('status'), /pair 2/);
    await page.keyboard.press('Delete');
    assert.equal((await rows()).length, 1);
    await page.click('#undo');
    assert.equal((await rows()).length, 2);
    await page.keyboard.press('Escape');
  });
  await check('names are kept, and that of the other side is offered', async () => {
    await page.type('#next', 'Left ear');
    await pair(a[4], b[4]);
    assert.equal(await text('mirror'), 'Right ear');
    await page.click('#mirror');
    await pair(a[5], b[5]);
    const names = await page.$$eval('#pairs input', (all) => all.map(({ value }) => value));
    assert.deepEqual(names, ['', '', 'Left ear', 'Right ear']);
    assert(await page.$eval('#mirror', ({ hidden }) => hidden), 'both have their names');
  });
  const whole = () => ['source_index,target_index', line(a[3], b[0]), line(a[2], b[2]), '# name: Left ear', line(a[4], b[4]), '# name: Right ear', line(a[5], b[5]), ''].join('\n');
  await check('the file holds what was clicked, without half a pair', async () => {
    await click(a[0]);
    await page.click('#save');
    await says('saved', 'Saved 4 pairs');
    assert.match(await text('saved'), /one point only was left out/);
    assert.equal(fs.readFileSync(pairsFile, 'utf8'), whole());
    await page.keyboard.press('Escape');
    assert.equal((await rows()).length, 4);
  });
  await keep('pick-light');
  await check('every control has a name', async () => {
    const nameless = await page.$$eval(':is(button, input, select, canvas[tabindex]):not([hidden])', (all) => all
      .filter((one) => !(one.getAttribute('aria-label') || one.ariaLabel || one.textContent.trim() || (one.labels && one.labels.length)))
      .map((one) => one.outerHTML.slice(0, 80)));
    assert.deepEqual(nameless, []);
  });
  await check('pairs are loaded from a file, and what is none is refused with its line', async () => {
    const chooser = await page.$('#load');
    const given = path.join(place, 'given.csv');
    fs.writeFileSync(given, 'source,target,confidence\n5,6,0.5\n# name: tail\n7,8\n');
    await chooser.uploadFile(given);
    await says('saved', 'Loaded 2 pairs');
    assert.deepEqual(await rows(), ['vertex 5 → 6', 'vertex 7 → 8']);
    fs.writeFileSync(given, '0,1\n5,999999\n');
    await chooser.uploadFile(given);
    await says('saved', 'line 2');
    assert.equal((await rows()).length, 2);
    await page.click('#undo');
    assert.equal((await rows()).length, 4);
  });
  await check('keys alone place a point, and change the look', async () => {
    await page.focus('#source');
    await page.keyboard.press('Enter');
    const has_begun = (await rows()).length === 5;
    assert(has_begun, 'the middle of the picture is on the fox');
    await page.keyboard.press('Escape');
    await page.keyboard.press('t');
    assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), 'dark');
    await page.keyboard.press('w');
    assert(await page.$eval('#wire', ({ checked }) => checked));
    await keep('pick-dark');
    await page.keyboard.press('?');
    assert(await page.$eval('#keys', (keys) => keys.open), 'the list of keys opens');
    await page.keyboard.press('Escape');
  });
  await check('a finger places a point, on a narrow page too', async () => {
    await page.setViewport({ width: 480, height: 1000, hasTouch: true });
    // Another kind of pointer loads the page anew; what was saved is there again.
    await page.waitForFunction(() => Number(document.documentElement.dataset.drawn) > 0, { timeout: 60000 });
    assert.equal((await rows()).length, 4);
    await page.evaluate(() => document.getElementById('view-oblique').click());
    // Not where a marker is, which a tap would choose.
    const one = (await inSight('target', 7)).find(({ vertex }) => b.every((other) => other.vertex !== vertex));
    const before = (await rows()).length;
    await page.touchscreen.tap(one.x, one.y);
    assert.deepEqual((await rows()).slice(before), [`vertex – → ${one.vertex}`]);
    await keep('pick-narrow');
    await page.evaluate(() => document.getElementById('undo').click());
    await page.setViewport({ width: 1280, height: 800 });
  });
  await check('Done ends the command, which names the file', async () => {
    await page.click('#done');
    await page.waitForSelector('#ended', { timeout: 20000 });
    assert.match(await text('ended'), /pairs\.csv/);
    const { code, out, error } = await ended;
    assert.equal(code, 0, error);
    assert.equal(out, `${address}\n${pairsFile}\n`);
    assert.match(error, /4 pairs; go on with `isomorph morph /);
    assert.equal(fs.readFileSync(pairsFile, 'utf8'), whole());
  });
  await check('the page begins with given pairs, and says when the command has gone', async () => {
    const again = await offered('--pairs', pairsFile);
    children.push(again.child);
    await open(again.address);
    assert.deepEqual((await rows()).length, 4);
    assert.equal(await text('save'), 'Saved');
    again.child.kill('SIGINT');
    const { code, error } = await again.ended;
    assert.equal(code, 130, error);
    await page.click('#pairs li:nth-child(1) .remove');
    const heard = said.length;
    await page.click('#save');
    await says('saved', 'no longer answers');
    // The browser itself tells of the failed request.
    assert(said.splice(heard).every((line) => line.includes('ERR_CONNECTION_REFUSED')), said.join('; '));
    assert.equal(fs.readFileSync(pairsFile, 'utf8'), whole());
  });
  await check('the page in a file saves by download', async () => {
    const file = path.join(place, 'page.html');
    const made = spawnSync(path.resolve(program), ['pick', ...shapes, '-o', 'mine.csv', '--page', file], { cwd: place, encoding: 'utf8' });
    assert.equal(made.status, 0, made.stderr);
    await open(pathToFileURL(file).href);
    assert.equal(await page.$eval('#done', (done) => getComputedStyle(done).display), 'none');
    await pair(a[0], b[0]);
    await page.click('#save');
    const saved = path.join(place, 'mine.csv');
    for (let k = 0; k < 100 && !fs.existsSync(saved); k++) await new Promise((done) => setTimeout(done, 100));
    assert.equal(fs.readFileSync(saved, 'utf8'), `source_index,target_index\n${line(a[0], b[0])}\n`);
  });
  await check('nothing is written to the console', async () => assert.deepEqual(said, []));
  await check('nothing is loaded from outside', async () => {
    const outside = asked.filter((url) => !url.startsWith('http://127.0.0.1:') && !/^(data|blob|about|file):/.test(url));
    assert.deepEqual(outside, []);
  });
} finally {
  await browser.close();
  children.forEach((child) => child.kill());
  fs.rmSync(place, { recursive: true, force: true });
}
conclude();
