import { expect, test } from "vitest";
import type { SubjectEvent } from "../../lib/protocol/types";
import { ancestry, laneOf, marksOf } from "./marks";

const event = (fields: object) => ({ facts: {}, ...fields }) as unknown as SubjectEvent;

test("events are in lanes by what they are", () => {
  expect(laneOf(event({ kind: "fault" }), "warning")).toBe("faults");
  expect(laneOf(event({ kind: "status" }), "alarm")).toBe("alarms");
  expect(laneOf(event({ kind: "status", facts: { workpiece: "mug.1" } }), "information")).toBe("workpieces");
  expect(laneOf(event({ kind: "button" }), "information")).toBe("others");
});

test("those that cannot be told apart share a mark, and none outside of the view has one", () => {
  const at = [90, 51, 50, 20, 5].map((time) => event({ time_ns: String(time) }));
  const marks = marksOf(at, { from_ns: 10n, span_ns: 75n }, 300);
  expect(marks.map(({ x, events }) => [Math.round(x), events.length])).toEqual([
    [40, 1],
    [160, 2],
  ]);
});

test("a branch knows where it comes from", () => {
  expect(ancestry("hall, branch 1 from 3.25 s, branch 2 from 4 s")).toEqual([
    "hall",
    "hall, branch 1 from 3.25 s",
    "hall, branch 1 from 3.25 s, branch 2 from 4 s",
  ]);
});
