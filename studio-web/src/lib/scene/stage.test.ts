import { expect, test } from "vitest";
import type { Mechanics, Model } from "../state/model";
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
} as unknown as Scene; // prettier-ignore
const AXIS = { name: "x", kind: "linear", travel: [0, 50], switches: [] } as unknown as Mechanics;
const MODEL = { mechanics: [AXIS], elements: [{ name: "cup", kind: "vacuum", drawing: null }] } as unknown as Model;

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
