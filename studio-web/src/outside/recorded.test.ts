import { expect, test } from "vitest";
import type { Piece } from "../lib/scene/pieces";
import { levelAt, valueAt, Workpieces } from "./recorded";

test("a value is that of the last polynomial that has begun, and unknown before the first one", () => {
  const spans = [1e9, 5, 2, 0, 0, 3e9, 9, 0, 1, 0.5];
  expect(valueAt(spans, 0)).toBeNaN();
  expect([1e9, 2e9, 3e9 - 1, 3e9, 5e9].map((at) => valueAt(spans, at))).toEqual([5, 7, 9 - 2e-9, 9, 17]);
  expect([0, 1, 2, 9].map((at) => levelAt([1, 0, 2, 1], at))).toEqual([null, 0, 1, 1]);
});

test("workpieces are those that are there, as the same list until one of them changes", () => {
  const [crate, box] = ["crate", "box"].map((name) => ({ name }) as Piece) as [Piece, Piece];
  const all = new Workpieces([[[10, crate], [30, null]], [[20, box]]]); // prettier-ignore
  expect([0, 10, 20, 30].map((at) => all.at(at).map(({ name }) => name))).toEqual([[], ["crate"], ["crate", "box"], ["box"]]); // prettier-ignore
  expect(all.at(25)).toBe(all.at(29));
  expect(all.at(15).map(({ name }) => name)).toEqual(["crate"]);
});
