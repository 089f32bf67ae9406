// What Khronos' validator says: node validate.mjs FILE.glb
import { readFileSync } from "node:fs";
import validator from "gltf-validator";

const report = await validator.validateBytes(new Uint8Array(readFileSync(process.argv[2])), { maxIssues: 100 });
console.log(JSON.stringify({ errors: report.issues.numErrors, warnings: report.issues.numWarnings,
  messages: report.issues.messages.map((each) => `${each.code} ${each.pointer}: ${each.message}`) }));
