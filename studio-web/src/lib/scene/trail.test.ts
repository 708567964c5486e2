import { expect, test } from "vitest";
import { POSE } from "./poses";
import type { Stage } from "./stage";
import { MOST, Trail } from "./trail";

const carried = new Float64Array(2 * POSE);
const MS = 1_000_000n;

test("a trail has the last ten seconds of a tip, and begins anew where time was not seen", () => {
  const trail = new Trail({ poses: { carried } } as unknown as Stage, 1);
  const go = (to_ms: bigint, x: number) => {
    carried[POSE + 9] = x;
    return trail.take(to_ms * MS);
  };
  expect([go(0n, 1), go(10n, 2), go(40n, 3)]).toEqual([true, false, true]);
  expect([...trail.places.slice(0, 6)]).toEqual([1, 0, 0, 3, 0, 0]);
  for (let n = 1; n < 1000; n++) go(BigInt(40 + 40 * n), 3 + n);
  expect(trail.count).toBe(MOST);
  expect([trail.places[0], trail.places[3 * (MOST - 1)]]).toEqual([1002 - MOST + 1, 1002]);
  go(60_000n, 7);
  expect([trail.count, trail.places[0]]).toEqual([1, 7]);
  go(50_000n, 8);
  expect([trail.count, trail.places[0]]).toEqual([1, 8]);
});
