import { expect, test } from "vitest";
import { polyline, scaleOf, ticksOf } from "./chart";

const BOX = { left: 10, top: 0, width: 100, height: 50 };

test("a curve fills its box, and its scale begins at 0", () => {
  const points = [
    [0, 0, 0],
    [1, 5, 60],
    [2, 10, 0],
  ];
  const speed = scaleOf([0, 60, 0]);
  expect(speed).toEqual({ low: 0, high: 60 });
  expect(polyline(points, 2, { low: 0, high: 2 }, speed, BOX)).toBe("10.0,50.0 60.0,0.0 110.0,50.0");
});

test("a move backward goes down from 0", () => {
  expect(scaleOf([0, -60])).toEqual({ low: -60, high: 0 });
  expect(scaleOf([0])).toEqual({ low: 0, high: 1 });
});

test("numbers of a scale are round", () => {
  expect(ticksOf({ low: 0, high: 60 })).toEqual([0, 20, 40, 60]);
  expect(ticksOf({ low: 0, high: 2.7 })).toEqual([0, 1, 2]);
  expect(ticksOf({ low: -1, high: 0.3 })).toEqual([-1, -0.5, 0]);
});
