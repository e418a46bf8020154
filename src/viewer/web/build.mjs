// Bundles the program of both pages into one file that is committed: node build.mjs
// With --check it builds anew, compares, and fails where the committed file is another one.
import { build } from 'esbuild';
import fs from 'node:fs';

const here = new URL('.', import.meta.url);
const target = new URL('../assets/viewer.js', here);
const version = JSON.parse(fs.readFileSync(new URL('node_modules/three/package.json', here))).version;

const made = await build({
  absWorkingDir: here.pathname,
  entryPoints: ['entry.js'],
  bundle: true,
  minify: true,
  format: 'iife',
  target: 'es2020',
  charset: 'ascii',
  legalComments: 'none',
  write: false,
  banner: { js: `/* The viewer of isomorph, MIT OR Apache-2.0. Contains three.js ${version}, MIT, (c) 2010-2026 three.js authors. */` },
});
const text = made.outputFiles[0].text;
if (/<\/script|<!--/i.test(text)) throw new Error('viewer.js would end the script that it is put into');

if (process.argv.includes('--check')) {
  if (fs.readFileSync(target, 'utf8') !== text) {
    console.error('src/viewer/assets/viewer.js is not what its sources give: run `npm ci` and `node build.mjs` in src/viewer/web');
    process.exit(1);
  }
  console.log('viewer.js is what its sources give');
} else {
  fs.mkdirSync(new URL('../assets/', here), { recursive: true });
  fs.writeFileSync(target, text);
  const licence = fs.readFileSync(new URL('node_modules/three/LICENSE', here));
  fs.writeFileSync(new URL('../assets/three-LICENSE.txt', here), licence);
  console.log(`${text.length} bytes`);
}
