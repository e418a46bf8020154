// Opens the page of a run in headless Chromium and holds it against what it promises.
//
//   node scripts/viewer_test.mjs RUN/report.html [FOLDER FOR PICTURES]
//
// Nothing is loaded from outside, nothing is written to the console, scrubbing and each button change the picture, keys
// do what the buttons do, a picture and a video are saved, and both themes are drawn.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

import { check, conclude, launch } from './browser.mjs';

const [file, pictures] = process.argv.slice(2);
const address = pathToFileURL(path.resolve(file)).href;
const saved = fs.mkdtempSync(path.join(os.tmpdir(), 'isomorph-viewer-'));
const browser = await launch();

try {
  const page = await browser.newPage();
  const [said, asked] = [[], []];
  page.on('console', (message) => said.push(`${message.type()}: ${message.text()}`));
  page.on('pageerror', (error) => said.push(error.message));
  page.on('request', (request) => asked.push(request.url()));
  const session = await page.createCDPSession();
  await session.send('Browser.setDownloadBehavior', { behavior: 'allow', downloadPath: saved });

  const drawn = () => page.evaluate(() => Number(document.documentElement.dataset.drawn || 0));
  // Waits until what was changed has been drawn.
  const settled = async (change) => {
    const before = await drawn();
    await change();
    await page.waitForFunction((count) => Number(document.documentElement.dataset.drawn) > count, { timeout: 20000 }, before);
  };
  const hash = (bytes) => createHash('sha256').update(bytes).digest('hex');
  const picture = () => page.evaluate(() => document.getElementById('canvas').toDataURL()).then(hash);
  const open = async (wish) => {
    await page.goto('about:blank');
    await page.goto(`${address}#${wish}`);
    await page.waitForFunction(() => Number(document.documentElement.dataset.drawn) > 0, { timeout: 60000 });
  };
  const keep = (name) => pictures && fs.mkdirSync(pictures, { recursive: true }) !== null && page.screenshot({ path: path.join(pictures, `${name}.png`) });
  const scrub = (t) => settled(() => page.evaluate((value) => {
    const time = document.getElementById('time');
    time.value = value;
    time.dispatchEvent(new Event('input'));
  }, t));
  const press = (selector) => settled(() => page.click(selector));
  const changes = async (words, change) => {
    const before = await picture();
    await change();
    assert.notEqual(await picture(), before, `${words} changes the picture`);
  };

  await open('t=0&theme=light');
  await check('the picture is not empty', async () => {
    const colours = await page.evaluate(() => {
      const canvas = document.getElementById('canvas');
      const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d');
      copy.drawImage(canvas, 0, 0);
      const data = copy.getImageData(0, 0, canvas.width, canvas.height).data;
      const found = new Set();
      for (let k = 0; k < data.length; k += 4) found.add(`${data[k]} ${data[k + 1]} ${data[k + 2]}`);
      return found.size;
    });
    assert(colours > 50, `${colours} colours`);
  });
  await check('scrubbing changes the picture, and back is the same', async () => {
    const seen = new Set();
    for (const t of [0, 0.3, 0.6, 1]) {
      await scrub(t);
      seen.add(await picture());
    }
    assert.equal(seen.size, 4);
    await scrub(0);
    assert(seen.has(await picture()), 'the first picture again');
    assert.equal(await page.$eval('#now', (now) => now.textContent), 't = 0.000');
  });
  await scrub(0.4);
  await keep('light');
  for (const name of ['surface', 'carried', 'points', 'pairs', 'arrows', 'wireframe', 'beside']) {
    const button = await page.$(`#show-${name}:not([disabled])`);
    if (!button) {
      console.log(`not in this run: ${name}`);
      continue;
    }
    await check(`the button ${name} changes the picture and takes it back`, async () => {
      const before = await picture();
      await press(`#show-${name}`);
      const after = await picture();
      assert.notEqual(after, before);
      await keep(`show-${name}`);
      await press(`#show-${name}`);
      assert.equal(await picture(), before);
    });
  }
  const colours = await page.$$eval('#colour option', (options) => options.map(({ value }) => value));
  await check(`the ${colours.length} ways to colour differ and show their scale`, async () => {
    const seen = new Set();
    for (const name of colours) {
      await settled(() => page.select('#colour', name));
      seen.add(await picture());
      const is_shown = await page.$eval('#scale', (scale) => !scale.hidden);
      assert.equal(is_shown, name !== 'plain', name);
      const most = await page.$eval('#scale-most', (most) => most.textContent);
      assert(name === 'plain' || /^[0-9.e-]+ (%|lengths)/.test(most), `${name}: ${most}`);
      await keep(`colour-${name}`);
    }
    assert.equal(seen.size, colours.length);
    await settled(() => page.select('#colour', 'plain'));
  });
  await check('each view differs', async () => {
    const views = await page.$$eval('#views > button', (buttons) => buttons.map(({ id }) => id));
    const seen = new Set();
    for (const id of views) {
      await press(`#${id}`);
      seen.add(await picture());
    }
    assert.equal(seen.size, views.length);
    await press('#view-oblique');
  });
  await check('dragging turns, scrolling and the buttons zoom', async () => {
    const box = await (await page.$('#canvas')).boundingBox();
    const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
    await changes('dragging', () => settled(async () => {
      await page.mouse.move(x, y);
      await page.mouse.down();
      await page.mouse.move(x + 80, y + 30, { steps: 4 });
      await page.mouse.up();
    }));
    await changes('scrolling', () => settled(() => page.mouse.wheel({ deltaY: -240 })));
    await changes('zooming', () => press('#zoom-out'));
    await press('#view-oblique');
  });
  await check('keys do what the buttons do', async () => {
    await page.evaluate(() => document.activeElement.blur());
    await changes('W', () => settled(() => page.keyboard.press('w')));
    assert.equal(await page.$eval('#show-wireframe', (button) => button.getAttribute('aria-pressed')), 'true');
    await settled(() => page.keyboard.press('w'));
    await settled(() => page.keyboard.press('End'));
    assert.equal(await page.$eval('#now', (now) => now.textContent), 't = 1.000');
    await settled(() => page.keyboard.press('ArrowLeft'));
    assert.equal(await page.$eval('#now', (now) => now.textContent), 't = 0.990');
    await page.keyboard.press('?');
    assert(await page.$eval('#keys', (keys) => keys.open), 'the list of keys opens');
    await page.keyboard.press('Escape');
  });
  await check('playing moves, and pausing stops', async () => {
    await scrub(0.2);
    await page.click('#play');
    await page.waitForFunction(() => Number(document.getElementById('time').value) > 0.25, { timeout: 30000 });
    await page.click('#play');
    const at = await page.$eval('#time', (time) => time.value);
    await new Promise((done) => setTimeout(done, 300));
    assert.equal(await page.$eval('#time', (time) => time.value), at);
  });
  await check('every control has a name', async () => {
    const nameless = await page.$$eval('button, input, select', (all) => all
      .filter((one) => !(one.getAttribute('aria-label') || one.textContent.trim() || (one.labels && one.labels.length)))
      .map((one) => one.outerHTML.slice(0, 80)));
    assert.deepEqual(nameless, []);
  });
  await check('recipe, quality and curves are there', async () => {
    assert((await page.$eval('#recipe', (recipe) => recipe.textContent)).includes('['));
    assert((await page.$$('#quality tbody tr')).length > 0, 'rows of quality');
    assert((await page.$$('#curves polyline')).length > 0, 'a curve');
  });
  await check('a picture and a video are saved', async () => {
    await page.click('#picture');
    await page.waitForFunction(() => document.getElementById('saved').textContent.startsWith('Picture saved'), { timeout: 20000 });
    await page.select('#speed', '4');
    await page.click('#video');
    await page.waitForFunction(() => /^(Video saved|The video)/.test(document.getElementById('saved').textContent), { timeout: 60000 });
    assert.match(await page.$eval('#saved', (saved) => saved.textContent), /^Video saved/);
    await new Promise((done) => setTimeout(done, 500));
    const names = fs.readdirSync(saved);
    assert(names.some((name) => name.endsWith('.png')) && names.some((name) => /\.(mp4|webm)$/.test(name)), names.join(' '));
    for (const name of names) assert(fs.statSync(path.join(saved, name)).size > 2000, `${name} is empty`);
  });
  await check('the dark theme is drawn, and side by side', async () => {
    const light = await picture();
    await open('t=0.4&theme=dark&show=surface');
    assert.notEqual(await picture(), light);
    await keep('dark');
    await open('t=0.6&theme=dark&show=surface,beside,arrows');
    await keep('dark-beside');
    await page.setViewport({ width: 480, height: 900 });
    await open('t=0.4&theme=light');
    await keep('narrow');
  });
  await check('nothing is written to the console', async () => assert.deepEqual(said, []));
  await check('nothing is loaded from outside', async () => {
    const outside = asked.filter((url) => !url.startsWith(address.split('#')[0]) && !/^(data|blob|about):/.test(url));
    assert.deepEqual(outside, []);
  });
  await check('the page has less than 6 MB', async () => assert(fs.statSync(file).size < 6e6, `${fs.statSync(file).size} bytes`));
} finally {
  await browser.close();
  fs.rmSync(saved, { recursive: true, force: true });
}
conclude();
