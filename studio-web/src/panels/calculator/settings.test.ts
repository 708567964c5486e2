import { expect, test } from "vitest";
import type { ControllerModel } from "../../lib/state/model";
import { changesOf, sendingOf, type Setting } from "./settings";

function controller(points: string[], commands: string[], unit: number | null): ControllerModel {
  return {
    name: "one",
    unit,
    points: new Map(points.map((path) => [path, {}])),
    sheet: { commands: commands.map((code) => ({ code })) },
  } as unknown as ControllerModel;
}

const setting = (code: string, value: number): Setting => ({ name: code, code, detail: "", value, unit: "" });

test("registers are written by their names", () => {
  const { changes } = changesOf([setting("M1_ACC", 300), setting("M1_DEC", 200)], new Map([["M1_ACC", 100]]));
  expect(sendingOf(controller(["M1_ACC", "M1_DEC"], [], 1), changes, ({ value }) => value)).toEqual({
    writes: { "one.M1_ACC": 300, "one.M1_DEC": 200 },
    text: "",
  });
});

test("what was not known before is not undone", () => {
  const { changes } = changesOf([setting("M1_ACC", 300), setting("M1_DEC", 200)], new Map([["M1_ACC", 100]]));
  expect(sendingOf(controller(["M1_ACC", "M1_DEC"], [], 1), changes, ({ old }) => old).writes).toEqual({
    "one.M1_ACC": 100,
  });
});

test("commands go to the line, for the one controller that is meant", () => {
  const { changes } = changesOf([setting("V", 2000), setting("A", 900)], new Map());
  const chip = controller([], ["V", "A", "X"], 10);
  expect(sendingOf(chip, changes, ({ value }) => value).text).toBe("XA\rV2000\rA900\r");
  expect(sendingOf(chip, [], ({ value }) => value).text).toBe("");
});

test("nothing to send where the controller has the values, in single precision", () => {
  expect(changesOf([setting("V", 0.1)], new Map([["V", Math.fround(0.1)]])).same).toBe(true);
  expect(changesOf([setting("V", 0.1)], new Map([["V", null]])).same).toBe(false);
});
