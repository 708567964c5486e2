import { expect, test } from "vitest";
import type { Model } from "../state/model";
import type { Solid } from "./builder";
import type { Scene } from "./poses";
import { solidsOf } from "./solids";

const frame = (name: string, kind: string, along: string | null = null) => ({ name, kind, on: null, at: [0, 0, 0], along, joints: [] }); // prettier-ignore
const element = (name: string, length = 0) => ({ name, inputs: [], outputs: [], drawing: { length, places: [], switches: [] } }); // prettier-ignore

function solidsWith(frames: object[], lists: object, elements: object[] = []): Solid[] {
  const scene = { frames, bodies: [], cups: [], nests: [], beams: [], origins: [], ...lists } as unknown as Scene;
  const named = frames.map((one) => element((one as { name: string }).name));
  return solidsOf(scene, { mechanics: [], elements: [...elements, ...named] } as unknown as Model);
}

const lowest = (solids: readonly Solid[]) => Math.min(...solids.map(({ at, size }) => at[2] - size[2] / 2));
const light = (solids: readonly Solid[]) => solids.filter(({ material }) => material === "light");

test("the lip of a cup is at its origin, as wide as it is, and a ring is lit while it holds", () => {
  const solids = solidsWith([frame("cup", "vacuum")], { cups: [{ name: "cup", diameter: 24 }] });
  expect(lowest(solids)).toBeCloseTo(0);
  expect(Math.max(...solids.map(({ size }) => size[0]))).toBe(24);
  expect(solids.filter(({ pin }) => pin === "cup.held")).toHaveLength(1);
});

test("jaws meet in the middle when their gripper is closed", () => {
  const solids = solidsWith([frame("jaws", "gripper", "-y")], {}, [element("jaws", 30)]);
  const jaws = solids.filter(({ slide }) => slide !== null);
  expect(lowest(jaws)).toBe(0);
  const faces = (position: number) =>
    jaws.map(({ at, size, slide }) => Math.abs(at[1] + (slide?.by[1] ?? 0) * position) - size[1] / 2);
  expect(faces(0)).toEqual([15, 15]);
  expect(faces(30)).toEqual([0, 0]);
});

test("lines of a nest part its cells, on a plate, or on the body that carries it", () => {
  const its = { name: "tray", cells: [3, 1], pitch: [60, 50], cell: [50, 40] };
  const solids = solidsWith([frame("tray", "nest")], { nests: [its] });
  const bodies = [{ name: "desk", size: [400, 400, 20], diameter: null, height: null }];
  const carried = solidsWith([{ ...frame("tray", "nest"), on: "desk", at: [0, 0, 20] }], { nests: [its], bodies });
  expect(lowest(carried)).toBeCloseTo(0);
  expect(carried).toHaveLength(solids.length - 1);
  expect(Math.max(...solids.map(({ at, size }) => at[2] + size[2] / 2))).toBeCloseTo(0, 1);
  const lines = solids.filter(({ material, size }) => material === "mark" && size[1] === 40);
  expect(lines.map(({ at }) => at[0])).toEqual([-25, 30, 90, 145]);
});

test("a curtain has its lines in their direction, at most 40; a short beam has no receiver", () => {
  const beam = { name: "beam", length: 200, count: 3, pitch: 20, across: "-x" };
  const curtain = solidsWith([frame("beam", "beam", "-y")], { beams: [beam] });
  expect(light(curtain).map(({ at }) => at.map((one) => one + 0))).toEqual([[0, -100, 0], [-20, -100, 0], [-40, -100, 0]]); // prettier-ignore
  expect(light(curtain).every(({ size, pin }) => size[1] === 200 && pin === "beam.seen")).toBe(true);
  expect(curtain.filter(({ material }) => material === "drive")).toHaveLength(2);
  expect(light(solidsWith([frame("beam", "beam", "+x")], { beams: [{ ...beam, count: 500 }] })).length).toBeLessThan(
    41,
  );
  const near = solidsWith([frame("beam", "beam", "+x")], { beams: [{ ...beam, count: 1, length: 10 }] });
  expect(near.filter(({ material }) => material === "drive")).toHaveLength(0);
});
