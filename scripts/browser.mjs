// A headless Chromium, and checks that are counted: what the tests of the pages share.
//
// Chromium is the system's, or that of the variable CHROMIUM; puppeteer-core is installed by `npm ci` in src/viewer/web.
import { createRequire } from 'node:module';
import { pathToFileURL } from 'node:url';

const packages = createRequire(new URL('../src/viewer/web/package.json', import.meta.url));
const { default: puppeteer } = await import(pathToFileURL(packages.resolve('puppeteer-core')).href);

export const launch = () => puppeteer.launch({
  executablePath: process.env.CHROMIUM || '/usr/bin/chromium',
  // Without a GPU, WebGL is computed by SwiftShader.
  args: ['--no-sandbox', '--disable-dev-shm-usage', '--hide-scrollbars', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
  defaultViewport: { width: 1280, height: 800 },
});

let failed = 0;

/** Runs a test and says how it went. */
export async function check(words, test) {
  try {
    await test();
    console.log(`ok: ${words}`);
  } catch (error) {
    failed++;
    console.log(`FAILED: ${words}: ${error.message}`);
  }
}

/** Ends the process, with status 1 if a check has failed. */
export function conclude() {
  console.log(failed ? `${failed} checks failed` : 'all checks passed');
  process.exit(failed ? 1 : 0);
}
