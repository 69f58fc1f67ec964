// Prints the Khronos validator's report on a .glb or .gltf file as JSON.
import { readFile } from "node:fs/promises";
import { basename, dirname, join } from "node:path";
import validator from "gltf-validator";

const path = process.argv[2];
const report = await validator.validateBytes(new Uint8Array(await readFile(path)), {
  uri: basename(path),
  maxIssues: 1000,
  externalResourceFunction: async (uri) =>
    new Uint8Array(await readFile(join(dirname(path), decodeURIComponent(uri)))),
});
process.stdout.write(JSON.stringify(report));
