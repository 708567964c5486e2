import { expect, test } from "vitest";
import { AxisState } from "./axis.svelte";
import { Load } from "./load";
import type { AxisModel } from "./model";

const S = 1_000_000_000n;
/** Stands at 0 pulses, goes with 1000 pulses/s from 1 s to 2 s, and stands at 1000. */
function moving(): AxisState {
  const axis = new AxisState({ id: "a.M1", pulses_per_unit: 100 } as AxisModel);
  const plan = { start_ns: String(S), base: 0, final: 1000, segments: [[1, 0, 0, 1000, 0, 0, 1]] };
  axis.take({
    time_ns: "0",
    kind: "plan",
    origin: 0,
    plan: { ...plan, segments: [], final: 0, start_ns: "0" },
  } as never);
  axis.take({ time_ns: String(S), kind: "plan", origin: 0, plan } as never);
  return axis;
}
const seen = (position: number | null | undefined, isStalled = false) => ({ position, isStalled });

test("a load goes with the plan between the values that come", () => {
  const [axis, load] = [moving(), new Load(-50)];
  expect(load.at(axis, seen(3), S / 2n)).toBe(3);
  expect(load.at(axis, seen(3), (S * 3n) / 2n)).toBeCloseTo(3 - 500 / 50, 9);
  expect(load.at(axis, seen(-17), 3n * S)).toBe(-17);
});

test("a value is shown as it came where nothing is known of the plan, and where the motor is stalled", () => {
  const [axis, load] = [moving(), new Load(50)];
  expect(load.at(axis, seen(7), (S * 3n) / 2n)).toBe(7);
  expect(load.at(undefined, seen(7), 0n)).toBe(7);
  load.at(axis, seen(0), S / 2n);
  expect(load.at(axis, seen(4, true), (S * 3n) / 2n)).toBe(4);
  expect(load.at(axis, seen(undefined), S / 2n)).toBeNaN();
});

test("steps that were lost are seen when the drive stands", () => {
  const [axis, load] = [moving(), new Load(50)];
  load.at(axis, seen(0), S / 2n);
  expect(load.at(axis, seen(18), 3n * S)).toBe(18);
});
