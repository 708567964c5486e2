import { expect, test } from "vitest";
import type { Mechanics } from "../../lib/state/model";
import { arcOf, bodyOf, trackOf, zonesOf } from "./geometry";

const axis = (more: Partial<Mechanics>): Mechanics =>
  ({ name: "x", unit: "mm", kind: "linear", travel: null, switches: [], ...more }) as Mechanics;

test("a track goes from stop to stop", () => {
  expect(trackOf(axis({ travel: [-12, 252] }), [0, 0])).toEqual({ low: -12, high: 252, hasStops: true });
});

test("without stops it has room for switches and what was seen", () => {
  const switches = [{ pin: "a.IN1", low: null, high: -10, period: null }];
  const { low, high } = trackOf(axis({ switches }), [0, 90]);
  expect(low).toBeCloseTo(-15);
  expect(high).toBeCloseTo(95);
});

test("zones without an end go to the end of the track", () => {
  const switches = [
    { pin: "a.IN1", low: null, high: 0, period: null },
    { pin: "a.IN2", low: 75, high: null, period: null },
  ];
  expect(zonesOf(switches, { low: -100, high: 100, hasStops: true })).toEqual([
    { pin: "a.IN1", from: 0, to: 0.5 },
    { pin: "a.IN2", from: 0.875, to: 1 },
  ]);
});

test("marks come again", () => {
  const switches = [{ pin: "a.IN1", low: 0, high: 1, period: 10 }];
  expect(zonesOf(switches, { low: 0, high: 40, hasStops: true }).map(({ from }) => from)).toEqual([
    0, 0.25, 0.5, 0.75, 1,
  ]);
});

test("a rod comes out of its body, a workpiece ends behind its front", () => {
  expect(bodyOf({ shape: "rod", length: 60, size: 0, low: 0 }, 15)).toEqual([0, 0.25]);
  expect(bodyOf({ shape: "belt", length: 400, size: 40, low: 0 }, 200)).toEqual([0.4, 0.5]);
  expect(bodyOf({ shape: "belt", length: 400, size: 40, low: 0 }, 20)).toEqual([0, 0.05]);
  expect(bodyOf({ shape: "slide", length: 400, size: 0, low: -100 }, 0)).toEqual([0.25, 0.25]);
  expect(arcOf(10, 0, 90)).toBe("M0.00 -10.00 A10 10 0 0 1 10.00 -0.00");
  expect(arcOf(10, 90, 360)).toBe("M10.00 -0.00 A10 10 0 1 1 -0.00 -10.00");
});
