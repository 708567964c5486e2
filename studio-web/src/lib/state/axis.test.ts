import { expect, test } from "vitest";
import type { SubjectEvent } from "../protocol/types";
import { AxisState } from "./axis.svelte";
import type { AxisModel } from "./model";

const MODEL = { id: "table.M1", pulses_per_unit: 100 } as AxisModel;
const event = (time_ns: bigint, more: object) => ({ time_ns: String(time_ns), ...more }) as never;
/** Stands at so many pulses. */
const stands = (time_ns: bigint, base: number): Extract<SubjectEvent, { kind: "plan" }> =>
  event(time_ns, { kind: "plan", origin: 0, plan: { start_ns: String(time_ns), base, final: 0, segments: [] } });
const sample = (time_ns: bigint, position: number): Extract<SubjectEvent, { kind: "sample" }> =>
  event(time_ns, { kind: "sample", position });

test("where time has gone back, plans of later are forgotten", () => {
  const axis = new AxisState(MODEL);
  for (const [at, base] of [
    [0n, 0],
    [100n, 500],
    [200n, 900],
  ] as const)
    axis.take(stands(at, base));
  const before = axis.revision;
  axis.forgetAfter(100n);
  expect(axis.revision).toBeGreaterThan(before);
  expect([50n, 100n, 900n].map((at) => axis.shown(at))).toEqual([0, 5, 5]);
  axis.take(stands(150n, 700));
  expect(axis.shown(900n)).toBe(7);
  axis.forgetAfter(-1n);
  expect(axis.shown(900n)).toBeNaN();
});

test("where time has gone back, samples of later are forgotten", () => {
  const axis = new AxisState(MODEL);
  axis.take(sample(100n, 1));
  axis.take(sample(200n, 2));
  axis.forgetAfter(150n);
  expect(axis.at(900n).position).toBe(1);
});

test("at a moment that is looked at its plan holds, and only there", () => {
  const axis = new AxisState(MODEL);
  axis.take(stands(500n, 900));
  axis.show(stands(100n, 300));
  expect([99n, 100n, 600n].map((at) => axis.shown(at))).toEqual([9, 3, 9]);
  axis.show(null);
  expect(axis.shown(100n)).toBe(9);
});

test("what happened while nothing came is unknown, until the past is asked for it", () => {
  const axis = new AxisState(MODEL);
  axis.take(stands(0n, 0));
  axis.lose(100n);
  expect(axis.at(150n).position).toBeNaN();
  expect(axis.isMoving(150n)).toBeNull();
  axis.take(stands(200n, 900));
  axis.take(stands(300n, 1000));
  expect([99n, 100n, 199n, 200n, 300n].map((at) => axis.shown(at))).toEqual([0, NaN, NaN, 9, 10]);
  axis.takeEarlier([stands(50n, 0), stands(120n, 500)], 50n, 200n);
  expect([99n, 119n, 120n, 199n, 200n, 300n].map((at) => axis.shown(at))).toEqual([0, 0, 5, 5, 9, 10]);
  axis.takeEarlier([stands(150n, 700)], 110n, 200n); // events were dropped before it
  expect([109n, 110n, 149n, 150n, 200n].map((at) => axis.shown(at))).toEqual([0, NaN, NaN, 7, 9]);
});
