// Poses of frames by the code of the page, for tests: a list of [scene, values of its signals] from the standard input; the answer has
// for each the pose of what is on the last frame.

import { readFileSync } from "node:fs";
import ts from "typescript";

const source = readFileSync(new URL("../src/lib/scene/poses.ts", import.meta.url), "utf-8");
const { outputText } = ts.transpileModule(source, { compilerOptions: { target: "ES2022", module: "ESNext" } });
const { POSE, Poses } = await import(`data:text/javascript,${encodeURIComponent(outputText)}`);

const found = JSON.parse(readFileSync(0, "utf-8")).map(([scene, values]) => {
  const poses = new Poses(scene);
  poses.values.set(poses.signals.map((signal) => values[signal]));
  poses.update();
  return [...poses.carried.slice(-POSE)];
});
console.log(JSON.stringify(found));
