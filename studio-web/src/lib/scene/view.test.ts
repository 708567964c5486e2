import { expect, test } from "vitest";
import type { Model } from "../state/model";
import type { Scene } from "./poses";
import { Stage } from "./stage";
import { dot, plus, times, type Solid } from "./builder";
import { facesOf } from "./faces";
import { frameOf, Order, placeAlong, standOf, VIEWS, type ViewName } from "./view";

type Box = readonly [name: string, at: readonly number[], size: readonly number[], on?: string];

function stageOf(boxes: readonly Box[], more: Scene["frames"] = []): Stage {
  const frames = boxes.map(([name, at, , on = null]) => ({ name, kind: "body", on, at: [...at], along: null, joints: [] })); // prettier-ignore
  const bodies = boxes.map(([name, , size]) => ({ name, size: [...size], diameter: null, height: null, color: null, when: null })); // prettier-ignore
  const model = { mechanics: [], elements: [] } as unknown as Model;
  return new Stage(
    { frames: [...frames, ...more], bodies, cups: [], nests: [], beams: [], origins: [] } as unknown as Scene,
    model,
  );
}

function orderOf(stage: Stage, view: ViewName): string[] {
  const order = new Order(stage, VIEWS[view]);
  order.update();
  return [...order.drawn].map((n) => stage.solids[n]?.element ?? "");
}

test("what is in front is drawn last, from every side", () => {
  const stage = stageOf([
    ["shelf", [0, 100, 50], [400, 50, 10]],
    ["bed", [0, 0, 0], [1000, 400, 20]],
    ["post", [300, 100, 20], [30, 30, 300]],
    ["crate", [0, -100, 20], [100, 100, 100]],
  ]);
  for (const view of ["oblique", "top"] as const) {
    const found = orderOf(stage, view);
    expect(found[0]).toBe("bed");
  }
  const front = orderOf(stage, "front");
  expect(front.indexOf("crate")).toBeGreaterThan(front.indexOf("shelf"));
  const side = orderOf(stage, "side");
  expect(side.indexOf("post")).toBeGreaterThan(side.indexOf("shelf"));
});

test("things that reach into each other are drawn as they stand for the most part", () => {
  const stage = stageOf([
    ["slide", [0, -100, 18], [600, 40, 40]],
    ["bed", [0, 0, 0], [1000, 400, 20]],
  ]);
  expect(orderOf(stage, "oblique")).toEqual(["bed", "slide"]);
});

test("what turns is drawn turned, and stands where its carrier has it", () => {
  const turns = [{ signal: "table.position", along: "+z", turns: true, per_unit: 1 }];
  const stage = stageOf(
    [["box", [100, 0, 0], [20, 10, 30], "table"]],
    [{ name: "table", kind: "axis", on: null, at: [10, 0, 5], along: null, joints: turns, line: 1, file: null }],
  );
  stage.poses.values[0] = 90;
  stage.update();
  const { places } = stage;
  expect([placeAlong(VIEWS.top.right, places, 0), placeAlong(VIEWS.top.up, places, 0)]).toEqual([10, 100]);
  const [solid] = stage.solids;
  if (solid === undefined) throw new Error("no solid");
  expect(facesOf(solid, places, 0, VIEWS.top)).toEqual({ front: "", side: "", top: "M-5.00 -10.00L-5.00 10.00L5.00 10.00L5.00 -10.00Z" }); // prettier-ignore
  expect(frameOf(VIEWS.top, stage.extents)[2]).toBeGreaterThan(200);
});

test("a picture has room for what is in it, and not for the corners of a box about all", () => {
  const { extents, extent } = stageOf([
    ["bed", [0, 0, 0], [1000, 400, 20]],
    ["post", [400, -150, 20], [30, 30, 300]],
  ]);
  for (const view of ["front", "side", "top"] as const)
    expect(frameOf(VIEWS[view], extents)).toEqual(frameOf(VIEWS[view], [extent]));
  const [, , wide, tall] = frameOf(VIEWS.oblique, extents);
  const [, , widest, tallest] = frameOf(VIEWS.oblique, [extent]);
  expect(wide).toBeCloseTo(widest);
  expect(tall).toBeLessThan(0.8 * tallest);
});

test("the end of a cylinder that is seen fills its outline, whichever way it lies", () => {
  const poses = new Float64Array([1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
  const turns = (path: string) => {
    const points = path
      .slice(1, -1)
      .split("L")
      .map((one) => one.split(" ").map(Number) as [number, number]);
    return Math.sign(points.reduce((sum, [x, y], k) => sum + x * points.at(k - 1)![1] - y * points.at(k - 1)![0], 0));
  };
  for (const axis of [0, 1, 2]) {
    const prism = {
      ends: [1, 1] as const,
      axis,
      corners: 32,
      towards: axis === 0 ? ([0, 1, 0] as const) : ([1, 0, 0] as const),
    };
    const { front, side, top } = facesOf({ size: [40, 40, 40], prism } as unknown as Solid, poses, 0, VIEWS.oblique);
    const [outline, ...others] = (front + side + top)
      .split("Z")
      .slice(0, -1)
      .map((one) => turns(`${one}Z`));
    expect(others).toEqual([outline]);
  }
});

test("a picture in central perspective has all in it, and not more room than it needs", () => {
  const { extents } = stageOf([
    ["bed", [0, 0, 0], [1000, 400, 20]],
    ["post", [450, 100, 20], [30, 30, 300]],
  ]);
  const slopes = [0.3, 0.2] as const;
  for (const { right, up, near } of Object.values(VIEWS)) {
    const { middle, far } = standOf({ right, up, near }, extents, slopes);
    const seen = extents.flatMap(({ low, high }) =>
      [low[0], high[0]].flatMap((x) =>
        [low[1], high[1]].flatMap((y) =>
          [low[2], high[2]].map((z) => {
            const from = plus([x, y, z], times(middle, -1));
            const deep = far - dot(near, from);
            return Math.max(Math.abs(dot(right, from)) / slopes[0], Math.abs(dot(up, from)) / slopes[1]) / deep;
          }),
        ),
      ),
    );
    expect(Math.max(...seen)).toBeCloseTo(1 / 1.12, 9);
  }
});
