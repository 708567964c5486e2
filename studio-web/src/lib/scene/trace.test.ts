import { expect, test } from "vitest";
import type { Scene } from "./poses";
import { Poses } from "./poses";
import { MOST, STEP_NS, Trace } from "./trace";

const joint = (signal: string, along: string, turns = false) => ({ signal, along, turns, per_unit: 1 });
const frame = (name: string, on: string | null, at: number[], joints: unknown[]) => ({ name, kind: "axis", on, at, along: null, joints }); // prettier-ignore

function penOn(table: boolean): {
  draw: (x: number, isDown: boolean, turn?: number) => void;
  trace: Trace;
  wait: (ns: number) => void;
} {
  const frames = [
    frame("table", null, [0, 0, 50], [joint("turn", "+z", true)]),
    frame("pen", null, [100, 0, 50], [joint("x", "+x")]),
  ];
  const poses = new Poses({ frames } as unknown as Scene, ["down"]);
  const trace = new Trace(poses, 1, table ? 0 : -1, 2);
  let now = 0;
  const draw = (x: number, isDown: boolean, turn = 0) => {
    poses.values.set([turn, x, +isDown]);
    poses.update();
    trace.take((now += STEP_NS));
  };
  return { draw, trace, wait: (ns) => (now += ns) };
}

const pointsOf = ({ points, count }: Trace) =>
  Array.from({ length: count }, (_, k) => [...points.subarray(3 * k, 3 * k + 3)].map((one) => Math.round(one * 1000) / 1000)); // prettier-ignore

test("straight strokes are two points each, with a gap between them", () => {
  const { draw, trace } = penOn(false);
  draw(0, false);
  for (const x of [0, 10, 20, 30]) draw(x, true);
  draw(35, false);
  draw(50, false);
  draw(60, true);
  draw(70, true);
  expect(pointsOf(trace).map(([x]) => x)).toEqual([100, 135, NaN, 160, 170]);
  expect([trace.low[0], trace.high[0]]).toEqual([100, 170]);
});

test("a line goes on with what it is drawn on, and what turns below the pen gets an arc", () => {
  const { draw, trace } = penOn(true);
  for (let n = 0; n <= 18; n++) draw(0, true, 5 * n);
  const places = pointsOf(trace);
  expect(places[0]).toEqual([100, 0, 0]);
  expect(places.at(-1)).toEqual([0, -100, 0]);
  expect(places.length).toBeGreaterThan(10);
  for (const [x, y] of places) expect(Math.hypot(x as number, y as number)).toBeCloseTo(100, 2);
});

test("where time was not seen the line begins anew, and it never has too many points", () => {
  const { draw, trace, wait } = penOn(false);
  draw(0, true);
  draw(10, true);
  wait(2e9);
  draw(500, true);
  expect(pointsOf(trace)).toEqual([[600, 0, 50]]);
  for (let n = 0; n < 3 * MOST; n++) draw(n % 2, true);
  expect(trace.count).toBeLessThanOrEqual(MOST);
});

test("the way of a tip has its last seconds, whether it draws or not", () => {
  const frames = [frame("tip", null, [0, 0, 0], [joint("x", "+x")])];
  const poses = new Poses({ frames } as unknown as Scene);
  const way = new Trace(poses, 0, -1, -1, 10 * STEP_NS);
  for (let n = 0; n < 50; n++) {
    poses.values[0] = n;
    poses.update();
    way.take(n * STEP_NS);
  }
  expect(pointsOf(way).map(([x]) => x)).toEqual([40, 41, 42, 43, 44, 45, 46, 47, 48, 49]);
});
