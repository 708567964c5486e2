import { expect, test } from "vitest";
import type { Model } from "../state/model";
import { POSE, type Scene } from "./poses";
import { Stage } from "./stage";

const frame = { at: [0, 0, 0], along: null, joints: [], line: 1, file: null };
const SCENE = {
  frames: [
    { ...frame, name: "x", kind: "axis", on: null, joints: [{ signal: "x.position", along: "+x", turns: false, per_unit: 10 }] },
    { ...frame, name: "cup", kind: "vacuum", on: "x", at: [0, 5, -40] },
  ],
  bodies: [],
  cups: [{ name: "cup", diameter: 20 }],
  nests: [],
  beams: [],
  origins: [],
} as unknown as Scene; // prettier-ignore
const AXIS = { name: "x", controller: "table", axis: "1", kind: "linear", travel: [0, 50], switches: [], brake: "b" };
const LIMITS = ["table.M1_POSLIM_L", "table.M1_POSLIM_R"];
const controllers = [{ name: "table", axes: [{ number: 1, limits: LIMITS }] }];
const MODEL = {
  controllers,
  mechanics: [AXIS],
  elements: [{ name: "cup", kind: "vacuum", drawing: null }],
} as unknown as Model;

test("what works on workpieces is drawn where its motion ends, while it goes there and somebody wants to see it", () => {
  const stage = new Stage(SCENE, MODEL, [], true);
  const ghosts = stage.solids.flatMap(({ material }, n) => (material === "ghost" ? n : []));
  const real = stage.solids.findIndex(({ element }) => element === "cup");
  const shown = (value: number, target: number): (number | null)[] => {
    stage.poses.values[0] = value;
    stage.targets[0] = target;
    stage.update();
    return [real, ghosts[0]!].map((n) => (stage.isThere[n] ? stage.places[n * POSE + 9]! : null));
  };
  expect(ghosts.map((n) => stage.solids[n]!.element)).toContain("cup");
  expect(shown(10, 30)).toEqual([100, null]);
  stage.showsTargets = true;
  expect(shown(10, 30)).toEqual([100, 300]);
  expect(shown(29.95, 30)).toEqual([299.5, null]);
  expect(shown(30, NaN)).toEqual([300, null]);
});

test("the travel of an axis is beside it, with plates at the soft limits that are known, and the cup has a box where it can be", () => {
  const stage = new Stage(SCENE, MODEL, [], true);
  stage.poses.values[stage.poses.signals.indexOf("x.position")] = 10;
  stage.poses.values[stage.poses.signals.indexOf("table.M1_POSLIM_R")] = 45;
  const shown = (name: string | null) => {
    stage.travelShown = name;
    stage.update();
    return stage.solids.flatMap(({ material, size }, n) =>
      n >= stage.aids && stage.isThere[n] ? [[material, stage.places[n * POSE + 9], size[0] > 100] as const] : [],
    );
  };
  expect(shown("")).toEqual([]);
  // The bar, its ends, the pointer and one plate.
  expect(shown("x")).toEqual([250, 0, 500, 100, 450].map((at) => ["travel", at, at === 250]));
  expect(shown("cup")).toEqual([["workspace", 250, true]]);
  expect(shown(null)).toHaveLength(6);
});

test("a brake is behind the motor of its axis, and shows when it lets go", () => {
  const shoes = new Stage(SCENE, MODEL).solids.filter(({ pin }) => pin === "b.released");
  expect(shoes.map(({ element, material }) => [element, material])).toEqual(Array(2).fill(["b", "lamp"]));
});
