import { expect, test } from "vitest";
import { csvOf, linesOf, movedFirst, rangeOf, intervalsOf, valueAt, type Series } from "./curves";

const series = (values: Series["values"], at_s: number[], is_motion = false): Series => ({
  point: "table.M1.position",
  unit: "mm",
  is_text: typeof values[0] === "string",
  is_motion,
  is_thinned: false,
  at_s,
  values,
});

test("values of a motion are joined, others hold until the next one", () => {
  const time = [0, 10] as const;
  expect(linesOf(series([0, 10], [0, 10], true), time, 10, [0, 10], 100, 50)).toEqual(["0.0,50.0 100.0,0.0 100.0,0.0"]);
  expect(linesOf(series([0, 10], [0, 5]), time, 10, [0, 10], 100, 50)).toEqual([
    "0.0,50.0 50.0,50.0 50.0,0.0 100.0,0.0",
  ]);
});

test("a line ends where a value is not known", () => {
  const lines = linesOf(series([1, null, 2], [0, 4, 8]), [0, 10], 10, [0, 2], 100, 10);
  expect(lines).toEqual(["0.0,5.0 40.0,5.0", "80.0,0.0 100.0,0.0"]);
});

test("the range has room, also around one value", () => {
  expect(rangeOf([series([0, null, 100], [0, 1, 2])])).toEqual([-6, 106]);
  expect(rangeOf([series([0], [0])])).toEqual([-0.5, 0.5]);
  expect(rangeOf([series(["a"], [0])])).toBeNull();
});

test("a text holds from its moment on; the same text twice is one interval", () => {
  expect(intervalsOf(series(["on", "on", null, "off"], [0, 1, 2, 3]), 5)).toEqual([
    { from: 0, to: 2, text: "on" },
    { from: 3, to: 5, text: "off" },
  ]);
});

test("a value between two moments", () => {
  expect(valueAt(series([0, 10], [0, 10], true), 4)).toBe(4);
  expect(valueAt(series([0, 10], [0, 10]), 4)).toBe(0);
  expect(valueAt(series([0, 10], [2, 10]), 1)).toBeNull();
  expect(valueAt(series([0, 10], [0, 10], true), 12)).toBe(10);
});

test("a table has the unit of each value", () => {
  expect(csvOf([series([1.5, null], [0, 1])])).toBe(
    'point,unit,seconds,value\r\n"table.M1.position","mm",0,1.5\r\n"table.M1.position","mm",1,\r\n',
  );
});

test("what has moved is shown first", () => {
  const named = (point: string, values: Series["values"]) => ({ ...series(values, [0, 1]), point });
  expect(movedFirst([named("drum", [3]), named("feeder", [null, null]), named("x", [0, 5])])).toEqual([
    "x",
    "drum",
    "feeder",
  ]);
});
