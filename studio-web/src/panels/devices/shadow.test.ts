import { expect, test } from "vitest";
import { curvesOf } from "./shadow";

test("positions fill the box, and a difference is drawn above the middle", () => {
  const found = curvesOf(
    [
      [0, 0, 0, 0.02],
      [1, 10, 8, 0.5],
      [2, 10, 10, null],
    ],
    [0, 2],
    200,
    100,
    40,
  );
  expect(found.device.split(" ").map((point) => point.split(",")[0])).toEqual(["0.0", "100.0", "200.0"]);
  const [first, second] = found.device.split(" ").map((point) => Number(point.split(",")[1]));
  expect(first).toBeGreaterThan(90);
  expect(second).toBeLessThan(10);
  expect(found.most).toBe(2);
  // What is not compared has no difference.
  expect(found.difference).toBe("0.0,20.0 100.0,2.0");
});

test("an axis that stands is a level line", () => {
  const { device, most } = curvesOf(
    [
      [0, 5, 5, 0.02],
      [1, 5, 5, 0.02],
    ],
    [0, 1],
    100,
    50,
    20,
  );
  expect(device).toBe("0.0,25.0 100.0,25.0");
  expect(most).toBe(0.001);
});
