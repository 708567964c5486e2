import { expect, test } from "vitest";
import { ratesOf } from "./traffic";

const counted = (time_s: number, requests: number) => ({
  time_ns: String(time_s * 1e9),
  lines: [{ line: "bus", requests }],
});

test("a rate is that of the virtual time between two answers", () => {
  expect(ratesOf(counted(1, 10), counted(3, 50)).get("bus")).toBe(20);
  expect(ratesOf(null, counted(1, 10)).size).toBe(0);
  expect(ratesOf(counted(1, 10), counted(1, 10)).size).toBe(0);
});
