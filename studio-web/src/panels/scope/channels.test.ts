import { expect, test } from "vitest";
import type { Pen } from "../../lib/drawing/pen";
import { Passed } from "../../lib/state/passed";
import { drawFrames, drawStatements, frameCode } from "./channels";

const channel = {
  left: 0,
  right: 100,
  high: 0,
  low: 10,
  from_ns: 0n,
  to_ns: 100n,
  x: (time_ns: bigint) => Number(time_ns),
};

function fake(): { pen: Pen; drawn: unknown[] } {
  const drawn: unknown[] = [];
  const note = (name: string) => (...given: unknown[]) => void drawn.push([name, ...given]); // prettier-ignore
  const pen = { beginPath: () => undefined, stroke: () => undefined, moveTo: () => undefined, lineTo: note("to"), fillText: note("text") }; // prettier-ignore
  return { pen: pen as unknown as Pen, drawn };
}

test("frames go up to the controllers and down from them, one of a kind in a column", () => {
  const passed = new Passed();
  for (const time_ns of [10n, 10n, 10n, 50n]) passed.take("bus", time_ns, frameCode(false, false));
  passed.take("bus", 60n, frameCode(true, false));
  passed.take("bus", 70n, frameCode(true, true));
  const { pen, drawn } = fake();
  drawFrames(pen, channel, passed, "bus", "blue", "red");
  expect(drawn).toEqual([
    ["to", 10.5, 0],
    ["to", 50.5, 0],
    ["to", 60.5, 10],
    ["to", 70.5, 10],
  ]);
});

test("statements have the number of their line where there is room", () => {
  const passed = new Passed();
  for (const line of [10, 11, 12]) passed.take("table", 5n, line);
  passed.take("table", 40n, 13);
  passed.take("table", 45n, 14);
  const { pen, drawn } = fake();
  drawStatements(pen, channel, passed, "table", "blue", "black");
  expect(drawn).toEqual([
    ["to", 5.5, 10],
    ["text", "12", 8.5, 5],
    ["to", 40.5, 10],
    ["to", 45.5, 10],
    ["text", "14", 48.5, 5],
  ]);
});
