import { expect, test } from "vitest";
import { turn } from "../../lib/scene/poses";
import { VIEWS } from "../../lib/scene/view";
import { fromThere, onGrid, seenFrom, stepOf, wayIn, wayOfKey } from "./moving";

const upright = () => Float64Array.of(1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0);

test("the grid is as fine as one can see", () => {
  expect([8, 1.2, 0.4].map((scale) => stepOf(scale, false))).toEqual([1, 5, 10]);
  expect(stepOf(0.4, true)).toBe(0.1);
});

test("only what goes comes onto the grid, and the rest stays as it is written", () => {
  expect(onGrid([12.3, 7.7, 0.25], [4, 0, 0], 5)).toEqual([15, 7.7, 0.25]);
  expect(onGrid([0, 0, 0], [0.26, 0, -0.31], 0.1)).toEqual([0.3, 0, -0.3]);
});

test("each view moves in its plane", () => {
  expect(wayIn(VIEWS.side, 3, 4)).toEqual([0, 3, 4]);
  expect(wayOfKey(VIEWS.top, "ArrowDown", 5)).toEqual([0, -5, 0]);
  expect(wayOfKey(VIEWS.top, "a", 5)).toBeNull();
});

test("on what has turned, it moves in the directions of that", () => {
  const pose = upright();
  turn(pose, 0, 2, 90);
  expect(seenFrom(pose, [10, 0, 0]).map(Math.round)).toEqual([0, -10, 0]);
  turn(pose, 0, 2, 27);
  const way = [3, -2, 7] as const;
  fromThere(pose, seenFrom(pose, way)).forEach((one, k) => expect(one).toBeCloseTo(way[k] as number, 9));
});
