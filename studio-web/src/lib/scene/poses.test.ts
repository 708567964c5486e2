import { expect, test } from "vitest";
import { POSE, Poses, type Scene } from "./poses";

const frame = (name: string, on: string | null, at: [number, number, number], ...joints: [string, string, boolean][]) => ({
  ...{ name, kind: "axis", on, at, along: null },
  joints: joints.map(([signal, along, turns]) => ({ signal, along, turns, per_unit: turns ? 360 : 10 })),
}); // prettier-ignore
const poseOf = (poses: Poses, frame: number) =>
  [...poses.carried.subarray(frame * POSE, (frame + 1) * POSE)].map((one) => one + 0);

test("what is on a frame goes with it, in the order of carrying", () => {
  const frames = [
    frame("cup", "arm", [0, 0, -5]),
    frame("arm", "table", [100, 0, 50], ["arm.position", "-z", false]),
    frame("table", null, [10, 20, 0], ["table.angle", "+z", true]),
  ];
  const poses = new Poses({ frames, bodies: [] } as unknown as Scene, ["belt.place1"]);
  expect(poses.signals).toEqual(["arm.position", "table.angle", "belt.place1"]);
  poses.values.set([2, 0.25, 7]);
  poses.update();
  expect(poseOf(poses, 0)).toEqual([0, -1, 0, 1, 0, 0, 0, 0, 1, 10, 120, 25]);
  expect([...poses.bases.subarray(POSE + 9, 2 * POSE)]).toEqual([10, 120, 50]);
});

test("a value that is not known leaves a frame at its origin, and quarter turns are exact after many turns", () => {
  const frames = [frame("a", null, [1, 2, 3], ["a.x", "+x", false], ["a.y", "-y", false]), frame("b", "a", [0, 0, 0], ["b.angle", "-x", true])]; // prettier-ignore
  const poses = new Poses({ frames, bodies: [] } as unknown as Scene);
  poses.values.set([NaN, 1, 1_000_000.5]);
  poses.update();
  expect(poseOf(poses, 1)).toEqual([1, 0, 0, 0, -1, 0, 0, 0, -1, 1, -8, 3]);
  expect([...poses.isKnown]).toEqual([1, 0, 0, 0]);
});
