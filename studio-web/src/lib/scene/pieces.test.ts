import { expect, test } from "vitest";
import type { Model } from "../state/model";
import type { Piece } from "./pieces";
import { POSE, type Scene } from "./poses";
import { Stage } from "./stage";

const MODEL = { mechanics: [], elements: [] } as unknown as Model;
const frame = (name: string, kind: string, more: object) => ({ name, kind, on: null, at: [0, 0, 0], along: null, joints: [], ...more }); // prettier-ignore
const SCENE = {
  frames: [
    frame("table", "axis", { joints: [{ signal: "table.position", along: "+z", turns: true, per_unit: 1 }] }),
    frame("cup", "vacuum", { on: "table", at: [100, 0, 50] }),
    frame("belt", "conveyor", { at: [10, 20, 30], along: "-y" }),
    frame("tray", "nest", {}),
  ],
  ...{
    bodies: [],
    nests: [],
    beams: [],
    origins: [
      { name: "belt", shape: null, color: null },
      { name: "tray", shape: null, color: null },
      { name: "press", shape: "bottle", color: "#3f9a63" },
    ],
    cups: [{ name: "cup", diameter: 24 }],
  },
} as unknown as Scene;

const piece = (name: string, on: string | null, more: Partial<Piece> = {}): Piece => ({
  ...{ name, on, size: [40, 30, 20], diameter: null, height: 20, at: [0, 0, 0], yaw: 0, moves: [] },
  ...more,
}); // prettier-ignore
const onBelt: Pick<Piece, "moves" | "at"> = {
  moves: [{ signal: "belt.travel", along: "-y", per_unit: 1, at: 500 }],
  at: [0, -40, 0],
};
const middleOf = ({ places }: Stage, n: number) => [...places.subarray(n * POSE + 9, n * POSE + 12)].map((one) => Math.round(one * 1e6) / 1e6); // prettier-ignore

function stageOf(...pieces: Piece[]): Stage {
  const stage = new Stage(SCENE, MODEL, pieces);
  stage.poses.values.fill(90);
  stage.update();
  return stage;
}

test("a held workpiece goes with what holds it, and is turned by it and in it", () => {
  const stage = stageOf(piece("tray.1", "cup", { at: [0, 0, -20], yaw: 90 }), piece("tray.2", null, { at: [7, 8, 0] }));
  const held = stage.fixed;
  expect(middleOf(stage, held)).toEqual([0, 100, 40]);
  expect([...stage.places.subarray(held * POSE, held * POSE + 9)].map((one) => one + 0)).toEqual([-1, 0, 0, 0, -1, 0, 0, 0, 1]); // prettier-ignore
  expect(middleOf(stage, held + 1)).toEqual([7, 8, 10]);
});

test("a workpiece on a belt goes on by the change of the way of the belt, once that is known", () => {
  const stage = stageOf(piece("belt.1", "belt", { ...onBelt, at: [0, -40, 0] }));
  const { pieces, fixed } = stage;
  expect(pieces.signals).toEqual(["belt.travel"]);
  expect(middleOf(stage, fixed)).toEqual([10, -20, 40]);
  pieces.values[0] = 512.5;
  stage.update();
  expect(middleOf(stage, fixed)).toEqual([10, -32.5, 40]);
  // Others come, and the way of the belt is known from before.
  stage.take([piece("tray.1", "tray"), piece("belt.1", "belt", { ...onBelt, at: [0, -40, 0] })]);
  stage.update();
  expect(middleOf(stage, fixed + 1)).toEqual([10, -32.5, 40]);
  stage.take([piece("tray.1", "tray")]);
  expect(pieces.signals).toEqual([]);
  expect(stage.solids).toHaveLength(fixed + 1);
});

test("a workpiece that is pushed across a belt goes on along it, too, as what pushes it moves", () => {
  const pushed = { signal: "table.position", along: "-x", per_unit: 0.5, at: 80 };
  const stage = stageOf(piece("belt.1", "belt", { ...onBelt, moves: [pushed, ...onBelt.moves] }));
  const { pieces, fixed, poses } = stage;
  expect(pieces.signals).toEqual(["belt.travel"]);
  pieces.values[0] = 512.5;
  stage.update();
  expect(middleOf(stage, fixed)).toEqual([10 - 0.5 * (90 - 80), -32.5, 40]);
  poses.values.fill(100);
  stage.update();
  expect(middleOf(stage, fixed)).toEqual([0, -32.5, 40]);
});

test("workpieces have the color of what they come from, wherever they are, and their own shape", () => {
  const { solids, fixed } = stageOf(
    piece("belt.12", "cup"),
    piece("tray.1", "belt", { size: null, diameter: 30, height: 25 }),
    piece("belt.3", "tray"),
  );
  const [one, other, third] = solids.slice(fixed);
  expect(one?.color).toBe(third?.color);
  expect(other?.color).not.toBe(one?.color);
  expect(one?.prism).toBeNull();
  expect(other?.size).toEqual([30, 30, 25]);
  expect(other?.prism?.axis).toBe(2);
  expect([one?.element, other?.element]).toEqual(["cup", "belt"]);
});

test("a workpiece with a shape is several solids, which turn and go with it", () => {
  const bottle = piece("press.4", "belt", { ...onBelt, size: null, diameter: 60, height: 120, yaw: 90 });
  const stage = stageOf(bottle, piece("belt.1", "tray"));
  const { solids, fixed, pieces } = stage;
  expect(pieces.names.slice(0, -1)).toEqual(pieces.names.slice(0, -1).map(() => "press.4"));
  const [body, ...others] = solids.slice(fixed, -1);
  expect(body?.color).toBe("#3f9a63");
  expect(others.map(({ size }) => size[0]).every((wide) => wide <= 60)).toBe(true);
  const heights = solids.slice(fixed, -1).map((_, n) => middleOf(stage, fixed + n)[2] as number);
  expect(heights).toEqual([...heights].sort((one, other) => one - other));
});
