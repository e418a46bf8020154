// Holds GLB files against the glTF specification with the validator of the Khronos Group.
//
//   node scripts/gltf_check.mjs FILE.glb ...
//
// Prints a line for each file and fails where one has an error, a warning or a remark. The validator is installed by
// `npm ci` in src/viewer/web.
import fs from 'node:fs';
import { createRequire } from 'node:module';

const packages = createRequire(new URL('../src/viewer/web/package.json', import.meta.url));
const validator = packages('gltf-validator');

const files = process.argv.slice(2);
if (!files.length) throw new Error('name at least one .glb file');
let failed = false;
for (const file of files) {
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { maxIssues: 20 });
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  const found = numErrors + numWarnings + numInfos + numHints;
  console.log(`${file}: ${found} issues, ${report.info.animationCount} animations, ${report.info.totalVertexCount} vertices, ${fs.statSync(file).size} bytes`);
  for (const { code, message, pointer } of messages) console.log(`  ${code} ${message} at ${pointer}`);
  failed ||= found > 0;
}
process.exit(failed ? 1 : 0);
