import { expect, test } from "vitest";
import type { Datasheet } from "../../lib/state/model";
import { changedKeys, changesOf, keysOf, pointsOf, settingsOf, type Form, type Setting } from "./form";

const setting = (name: string, text: string, value: number): Setting => ({ name, text, value }) as unknown as Setting;

const form = (...settings: Setting[]): Form => ({ sections: [{ name: "Axis0", settings }] }) as unknown as Form;

test("registers that have the value of the file, in single precision, are not written", () => {
  const present = new Map([
    ["M1_ACC", Math.fround(0.1)],
    ["M1_DEC", 5],
  ]);
  expect(changesOf({ M1_ACC: 0.1, M1_DEC: 6, M1_VMAX: 7 }, present)).toEqual([
    { point: "M1_DEC", value: 6, old: 5 },
    { point: "M1_VMAX", value: 7, old: null },
  ]);
});

test("what differs from the file as it was read", () => {
  const before = form(setting("Gear", "100", 100), setting("Acc", "", 1000));
  expect([...changedKeys(before, form(setting("Gear", "100", 100), setting("Acc", "300", 300)))]).toEqual([
    "Axis0.Acc",
  ]);
});

test("settings of a controller without a file are its commands whose number the state has", () => {
  const command = (code: string, count: number) => ({ code, arguments: Array(count).fill({}) });
  const details = ["V", "R", "A"].map((name) => ({ name, type: "whole number" }));
  const sheet = {
    commands: [command("V", 1), command("R", 0), command("L", 1), command("A", 1)],
    details,
  } as unknown as Datasheet;
  expect(settingsOf(sheet, { V: 1000, R: 3 }).map(([one, value]) => [one.code, value])).toEqual([
    ["V", 1000],
    ["A", null], // of a device, which does not show it
  ]);
});

test("only what was changed is written, and not what cannot be converted", () => {
  const acc = (text: string) => ({ ...setting("Acc", text, 500), point: "M1_ACC" });
  const points = (shown: Record<string, number>, ...settings: Setting[]) =>
    ({ ...form(...settings), points: shown }) as unknown as Form;
  const vel = { ...setting("Vel", "7", 7), point: "M1_VMAX" };
  const both = points({ M1_ACC: 500, M1_VMAX: 7 }, acc("500"), vel);
  expect(pointsOf(both, new Set(["Axis0.Acc"]))).toEqual({ points: { M1_ACC: 500 }, unknown: [] });
  expect(pointsOf(both, keysOf(both))).toEqual({ points: { M1_ACC: 500, M1_VMAX: 7 }, unknown: [] });
  expect(pointsOf(points({}, acc("500")), new Set(["Axis0.Acc"]))).toEqual({ points: {}, unknown: ["M1_ACC"] });
  expect(pointsOf(points({}, acc("")), new Set(["Axis0.Acc"]))).toEqual({ points: {}, unknown: [] }); // taken out again
});
