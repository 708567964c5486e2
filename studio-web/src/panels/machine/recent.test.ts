import { expect, test } from "vitest";
import { Recent } from "./recent";

const SECOND_NS = 1_000_000_000n;

test("a moment is computed once, and again when plans have changed or time has gone back", () => {
  const recent = new Recent(SECOND_NS / 50n);
  let computed = 0;
  const spot = (at_ns: bigint) => ({ at_ns, x: ++computed, y: 0 });
  const until = (now_ns: bigint, version: string) => {
    computed = 0;
    return recent.between(now_ns - SECOND_NS, now_ns, version, spot).map(({ at_ns }) => Number(at_ns / 1_000_000n));
  };
  const moments = (first: number) => Array.from({ length: 50 }, (_, index) => first + 20 * index);
  expect([until(5n * SECOND_NS, "a"), computed]).toEqual([moments(4000), 50]);
  expect([until(5n * SECOND_NS + 16_000_000n, "a"), computed]).toEqual([moments(4020), 1]);
  expect([until(5n * SECOND_NS + 16_000_000n, "b"), computed]).toEqual([moments(4020), 50]);
  expect([until(2n * SECOND_NS, "b"), computed]).toEqual([moments(1000), 50]);
  expect([until(9n * SECOND_NS, "b"), computed]).toEqual([moments(8000), 50]);
});
