import { expect, test } from "vitest";
import { nearest } from "./moments";

test("the nearest moment on either side, never the same one", () => {
  const moments = [50n, 10n, 30n, 20n];
  expect([5n, 10n, 25n, 99n].map((at) => nearest(moments, at, -1))).toEqual([null, null, 20n, 50n]);
  expect([5n, 10n, 25n, 99n].map((at) => nearest(moments, at, 1))).toEqual([10n, 20n, 30n, null]);
  expect(nearest([], 5n, -1)).toBeNull();
});
