import { expect, test } from "vitest";
import type { SubjectEvent } from "../protocol/types";
import { questionOf } from "./asking";
import type { Model } from "./model";

const axes = [{ number: 1, status: "table.M1.status" }];
const model = {
  controllers: [
    { name: "table", status: "table.status", axes },
    { name: "drum", status: null, axes: [{ number: 1, status: null }] },
  ],
  elements: [
    { name: "cup", outputs: ["HELD"], signals: [{ name: "pressure" }] },
    { name: "infeed", outputs: [], signals: [{ name: "count" }] },
    { name: "outfeed", outputs: ["sensor1"], signals: [{ name: "count" }] },
  ],
} as unknown as Model;

const status = (controller: string, axis: string | null = null, facts = {}) =>
  questionOf({ kind: "status", controller, axis, facts } as SubjectEvent, model);

test("an event is asked about by what it is about", () => {
  expect(status("table", "1")).toBe("table.M1.status");
  expect(status("table")).toBe("table.status");
  expect(status("drum", "1")).toBe("drum");
  expect(status("table", null, { element: "cup" })).toBe("cup.HELD");
  expect(status("table", null, { element: "infeed" })).toBe("infeed.count");
  expect(status("table", null, { element: "outfeed", workpiece: "a.1" })).toBe("outfeed.count");
  expect(status("table", null, { element: "cup", workpiece: "a.1" })).toBe("cup.HELD");
  expect(status("table", null, { element: "workpieces", workpiece: "a.1" })).toBe(null);
  expect(questionOf({ kind: "edge", controller: "table", pin: "IN3" } as SubjectEvent, model)).toBe("table.IN3");
  expect(questionOf({ kind: "pace" } as SubjectEvent, model)).toBe(null);
});
