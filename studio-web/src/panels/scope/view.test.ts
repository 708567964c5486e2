import { expect, test } from "vitest";
import { bounds, digitsOf, ticks, TimeView } from "./view";

const NOW = 100_000_000_000n;
const SECOND = 1_000_000_000n;

test("a view that follows ends at the present", () => {
  const view = new TimeView();
  expect(view.at(NOW)).toEqual({ from_ns: 90n * SECOND, span_ns: 10n * SECOND });
  view.zoom(2, 0.5, NOW);
  expect(view.isLive).toBe(true);
  expect(view.at(NOW)).toEqual({ from_ns: 95n * SECOND, span_ns: 5n * SECOND });
});

test("panning leaves the present and comes back to it", () => {
  const view = new TimeView();
  view.pan(-0.5, NOW);
  expect(view.isLive).toBe(false);
  expect(view.at(NOW + 50n * SECOND).from_ns).toBe(85n * SECOND);
  view.pan(0.6, NOW);
  expect(view.isLive).toBe(true);
});

test("what is under the pointer stays while zooming", () => {
  const view = new TimeView();
  view.centre(50n * SECOND);
  const before = view.at(NOW).from_ns + view.span_ns / 4n;
  view.zoom(4, 0.25, NOW);
  expect(view.at(NOW).from_ns + view.span_ns / 4n).toBe(before);
});

test("a span has bounds", () => {
  const view = new TimeView();
  for (let times = 0; times < 100; times++) view.zoom(10, 0.5, NOW);
  expect(view.span_ns).toBe(1000n);
  for (let times = 0; times < 100; times++) view.zoom(0.1, 0.5, NOW);
  expect(view.span_ns).toBe(86_400n * SECOND);
});

test("ticks", () => {
  expect(ticks(0, 10, 5)).toEqual([0, 2, 4, 6, 8, 10]);
  expect(ticks(-0.7, 0.7, 4)).toEqual([-0.5, 0, 0.5]);
  expect(ticks(1, 1, 4)).toEqual([]);
  expect(digitsOf([0, 0.05])).toBe(2);
  expect(digitsOf([0, 200])).toBe(0);
});

test("values have room around them", () => {
  expect(bounds(0, 100)).toEqual([-20, 120]);
  expect(bounds(NaN, NaN)).toEqual([-1, 1]);
  const [low, high] = bounds(7, 7);
  expect(low).toBeLessThan(7);
  expect(high).toBeGreaterThan(7);
});
