import { expect, test } from "vitest";
import { crossing } from "./trigger";

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
