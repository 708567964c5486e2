import { expect, test } from "vitest";
import { Arrangement } from "./arrangement.svelte";

test("a place is on the grid, and never left of or above the panel", () => {
  const arrangement = new Arrangement();
  arrangement.put("x", 14, 16);
  expect(arrangement.places).toEqual({ x: [10, 20] });
  arrangement.shift("x", -50, 10);
  expect(arrangement.places).toEqual({ x: [0, 30] });
});

test("undo goes back to what was remembered, also after a clear", () => {
  const arrangement = new Arrangement();
  arrangement.fix({ x: [0, 0], y: [3, 101] });
  expect(arrangement.isChanged).toBe(false);
  arrangement.remember();
  arrangement.put("x", 100, 0);
  arrangement.put("x", 200, 0); // of the same drag
  arrangement.clear();
  expect(arrangement.isByHand).toBe(false);
  arrangement.undo();
  expect(arrangement.places).toEqual({ x: [200, 0], y: [0, 100] });
  arrangement.undo();
  expect(arrangement.places).toEqual({ x: [0, 0], y: [0, 100] });
  expect(arrangement.canUndo).toBe(false);
  arrangement.undo();
  expect(arrangement.isByHand).toBe(true);
});

test("what the description has does not replace a change that is not saved", () => {
  const arrangement = new Arrangement();
  arrangement.take({ x: [10, 0] });
  arrangement.put("x", 50, 0);
  arrangement.take({ x: [10, 0] });
  expect(arrangement.places).toEqual({ x: [50, 0] });
  arrangement.saved();
  arrangement.take({ x: [70, 0] });
  expect(arrangement.places).toEqual({ x: [70, 0] });
});

test("what has a place keeps it when the others are fixed", () => {
  const arrangement = new Arrangement();
  arrangement.take({ x: [10, 0] });
  arrangement.fix({ x: [90, 90], y: [40, 40] });
  expect(arrangement.places).toEqual({ x: [10, 0], y: [40, 40] });
});
