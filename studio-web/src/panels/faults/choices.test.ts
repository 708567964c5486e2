import { expect, test } from "vitest";
import type { FaultKind, FaultParameter } from "../../lib/state/faults.svelte";
import type { Model } from "../../lib/state/model";
import { canHappen, choicesOf } from "./choices";

const sheet = {
  pins: [
    { name: "IN1", direction: "input", is_analog: false },
    { name: "AI", direction: "input", is_analog: true },
    { name: "OUT1", direction: "output", is_analog: false },
  ],
};
const model = {
  controllers: [{ name: "cell", isReal: false, unit: 3, sheet, axes: [{ number: 1 }, { number: 2 }] }],
  lines: [{ name: "bus", kind: "modbus" }],
  elements: [{ name: "lift", kind: "cylinder", inputs: ["extend"], outputs: ["extended"] }],
} as unknown as Model;
const kind = (fields: Partial<FaultKind>) => ({ layer: "physics", elements: [], lines: [], ...fields }) as FaultKind;

test("kinds are offered that something of the machine can have", () => {
  expect(canHappen(kind({ layer: "element", elements: ["cylinder"] }), model)).toBe(true);
  expect(canHappen(kind({ layer: "element", elements: ["relay"] }), model)).toBe(false);
  expect(canHappen(kind({ layer: "bytes", lines: ["M1486"] }), model)).toBe(false);
  expect(canHappen(kind({ layer: "frames", lines: ["Modbus RTU", "M1486"] }), model)).toBe(true);
});

test("places and levels are chosen from what there is", () => {
  const of = (name: string, given = {}, one = kind({ occasion: "change", elements: ["cylinder"] })) =>
    choicesOf({ name, words: [] } as unknown as FaultParameter, one, given, model, null, () => true);
  expect([of("element"), of("machine"), of("axis"), of("unit"), of("line")]).toEqual(
    [["lift"], ["cell"], ["1", "2"], ["3"], ["bus"]], // prettier-ignore
  );
  expect([of("pin"), of("pin", {}, kind({ occasion: "always" }))]).toEqual([["IN1", "AI"], ["IN1", "AI", "OUT1"]]); // prettier-ignore
  expect([of("value"), of("value", { pin: "AI" }), of("value", { pin: "OUT1" })]).toEqual([[], [], ["0", "1"]]);
  expect([of("input", { element: "lift" }), of("for_ms")]).toEqual([["extend"], []]);
});
