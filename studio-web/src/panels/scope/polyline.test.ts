import { expect, test } from "vitest";
import { Columns } from "./columns";
import { trace } from "./polyline";

/** What is drawn: `null` begins a line. */
function drawn(fill: (columns: Columns) => void, width = 1000): ([number, number] | null)[] {
  const columns = new Columns(width);
  fill(columns);
  const points: ([number, number] | null)[] = [];
  trace(columns, 0, (value) => value, {
    moveTo: (x, y) => void points.push(null, [x, y]),
    lineTo: (x, y) => void points.push([x, y]),
  });
  return points;
}

function follow(columns: Columns, value: (x: number) => number, from = 0, to = columns.width): void {
  for (let column = from; column < to; column++) {
    columns.add(column, value(column));
    columns.add(column, value(column + 1));
  }
}

test("a straight line has two points, whatever its slope", () => {
  for (const slope of [0.37, -3])
    expect(drawn((columns) => follow(columns, (x) => slope * x))).toEqual([null, [0, 0 * slope], [1000, 1000 * slope]]);
  expect(drawn((columns) => follow(columns, () => 4))).toEqual([null, [0, 4], [999, 4]]);
});

test("a curve is followed within the tolerance, with far fewer points than columns", () => {
  const value = (x: number) => 100 * Math.sin(x / 80);
  const points = drawn((columns) => follow(columns, value)).slice(1) as [number, number][];
  expect(points.length).toBeLessThan(200);
  for (let x = 0; x < 1000; x++) {
    const next = points.findIndex(([there]) => there > x);
    const [[x0, y0], [x1, y1]] = [points[next - 1], points[next]] as [[number, number], [number, number]];
    expect(Math.abs(y0 + ((y1 - y0) * (x - x0)) / (x1 - x0) - value(x))).toBeLessThan(0.5);
  }
});

test("a peak within a column is drawn, and a gap is none", () => {
  const points = drawn((columns) => {
    follow(columns, () => 5, 0, 10);
    columns.add(4, 90);
    columns.add(4, 5);
    follow(columns, () => 7, 20, 30);
  }, 40);
  expect(points).toContainEqual([4.5, 90]);
  expect(points.filter((point) => point === null)).toHaveLength(2);
  expect(points.at(-2)).toEqual([20, 7]);
});
