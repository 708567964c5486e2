import { expect, test } from "vitest";
import { crossing, stepOf } from "./trigger";

const ramp = (time_ns: bigint) => Number(time_ns) / 1e9;

test("a crossing is found to a microsecond, whatever the step", () => {
  for (const step of [1_000_000n, 333_333_333n, 5_000_000_000n]) {
    const found = crossing(ramp, { slope: "rising", level: 1.2345678 }, 0n, 5_000_000_000n, step);
    expect(Math.abs(Number(found) - 1.2345678e9)).toBeLessThanOrEqual(1000);
  }
});

test("a slope of the other direction is none", () => {
  expect(crossing(ramp, { slope: "falling", level: 1 }, 0n, 5_000_000_000n, 1_000_000n)).toBeNull();
  expect(crossing((at) => -ramp(at), { slope: "falling", level: -1 }, 0n, 5_000_000_000n, 1_000_000n)).not.toBeNull();
});

test("beyond the level from the beginning, or not known before, is no crossing", () => {
  expect(crossing(ramp, { slope: "rising", level: 1 }, 2_000_000_000n, 3_000_000_000n, 1_000_000n)).toBeNull();
  const late = (at: bigint) => (at < 500n ? NaN : 1);
  expect(crossing(late, { slope: "rising", level: 1 }, 0n, 1000n, 100n)).toBeNull();
});

test("all the time that has gone is looked through, in a bounded number of steps", () => {
  expect(stepOf(16_000_000n)).toBe(1_000_000n);
  expect(stepOf(60_000_000_000n)).toBe(30_000_000n);
  const gone = 3_600_000_000_000n;
  let asked = 0;
  const counted = (at: bigint) => (asked++, ramp(at));
  expect(crossing(counted, { slope: "rising", level: 1800 }, 0n, gone, stepOf(gone))).not.toBeNull();
  expect(asked).toBeLessThan(2100);
});

test("where time has gone back there is nothing between", () => {
  expect(crossing(ramp, { slope: "rising", level: 1 }, 5_000_000_000n, 0n, stepOf(-5_000_000_000n))).toBeNull();
});
