// Answers each line of standard input, the path of a .glb or .gltf file, with a line of JSON: the
// Khronos validator's report, or {"failure": "..."}.
import { readFile } from "node:fs/promises";
import { basename, dirname, join } from "node:path";
import { createInterface } from "node:readline";
import validator from "gltf-validator";

async function report(path) {
  return validator.validateBytes(new Uint8Array(await readFile(path)), {
    uri: basename(path),
    maxIssues: 1000,
    externalResourceFunction: async (uri) =>
      new Uint8Array(await readFile(join(dirname(path), decodeURIComponent(uri)))),
  });
}

for await (const path of createInterface({ input: process.stdin })) {
  const answer = await report(path).catch((error) => ({ failure: String(error) }));
  process.stdout.write(JSON.stringify(answer) + "\n");
}
