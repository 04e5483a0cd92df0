// Prints the JSON Schemas of the Foxglove messages that server/station/foxglove sends, by their names, from the
// package @foxglove/schemas. tools/page writes ../foxglove/foxglove_schemas.json with it.
import { createRequire } from "node:module";

const published = createRequire(import.meta.url)("@foxglove/schemas/jsonschema");
const used = ["CameraCalibration", "CompressedImage", "FrameTransforms", "LaserScan", "Log", "PoseInFrame", "RawImage", "SceneUpdate"];

for (const name of used) {
  if (!(name in published)) throw new Error(`@foxglove/schemas has no schema ${name}`);
}
process.stdout.write(JSON.stringify(Object.fromEntries(used.map((name) => [`foxglove.${name}`, published[name]])), null, 1) + "\n");
