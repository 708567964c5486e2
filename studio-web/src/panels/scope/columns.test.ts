import { readFileSync } from "node:fs";
import { expect, test } from "vitest";
import { AxisState } from "../../lib/state/axis.svelte";
import type { AxisModel } from "../../lib/state/model";
import type { Plan } from "../../lib/state/plan";
import { Columns, fill } from "./columns";

const model = { id: "table.M1", pulses_per_unit: 1 } as AxisModel;
const plan = (time_ns: bigint, plan: Plan, origin = 0) =>
  ({ kind: "plan", time_ns: String(time_ns), plan, origin }) as Parameters<AxisState["take"]>[0];

/** Up to 1 in half a second and back within the next. */
const THERE_AND_BACK: Plan = {
  start_ns: "0",
  base: 0,
  final: 0,
  segments: [
    [0.5, 0, 0, 2, 0, 0, 1],
    [1, 0.5, 1, -2, 0, 0, -1],
  ],
};

test("a corner between the ends of a column is in its extremes", () => {
  const axis = new AxisState(model);
  axis.take(plan(0n, THERE_AND_BACK));
  const columns = new Columns(1);
  fill(columns, axis, "position", 0n, 1_000_000_000n, 1_000_000_000n);
  expect([columns.low[0], columns.high[0]]).toEqual([0, 1]);
});

test("columns agree with the plan, at any zoom", () => {
  const file = new URL("../../../../tests/motion/plan_vectors.json", import.meta.url);
  const vectors = JSON.parse(readFileSync(file, "utf-8")) as {
    plans: { plan: Plan; at: [string, number, number][] }[];
  };
  for (const { plan: one, at } of vectors.plans) {
    const axis = new AxisState(model);
    axis.take(plan(0n, one));
    for (const [time_ns, position, velocity] of at) {
      const moment = BigInt(time_ns);
      for (const span of [1000n, 1_000_000_000n]) {
        const columns = new Columns(10);
        fill(columns, axis, "position", moment, span, moment + span);
        expect(columns.first[0]).toBeCloseTo(position, 5);
        fill(columns, axis, "velocity", moment, span, moment + span);
        expect(columns.first[0]).toBeCloseTo(velocity, 4);
      }
    }
  }
});

test("nothing is drawn before the first plan and after the present", () => {
  const axis = new AxisState(model);
  axis.take(plan(2_000_000_000n, { start_ns: "2000000000", base: 5, final: 0, segments: [] }));
  const columns = new Columns(10);
  fill(columns, axis, "position", 0n, 10_000_000_000n, 6_000_000_000n);
  expect([...columns.first].map((value) => Number.isNaN(value))).toEqual([
    true, true, false, false, false, false, false, true, true, true,
  ]); // prettier-ignore
  expect(columns.range()).toEqual([5, 5]);
});

test("samples of a device are joined", () => {
  const axis = new AxisState(model);
  for (const [time_ns, position] of [
    [0, 0],
    [1_000_000_000, 10],
  ]) {
    axis.take({ kind: "sample", time_ns: String(time_ns), position } as Parameters<AxisState["take"]>[0]);
  }
  const columns = new Columns(11);
  fill(columns, axis, "position", 0n, 1_100_000_000n, 1_100_000_000n);
  expect(columns.first[5]).toBeCloseTo(5);
});
