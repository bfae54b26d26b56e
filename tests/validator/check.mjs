// Prints Khronos's report of each file named, as one JSON list of the errors and warnings.
import { readFileSync } from "node:fs";
import { validateBytes } from "gltf-validator";

const reports = [];
for (const file of process.argv.slice(2)) {
  const { issues } = await validateBytes(new Uint8Array(readFileSync(file)));
  reports.push(issues.messages.filter(({ severity }) => severity < 2));
}
console.log(JSON.stringify(reports));
