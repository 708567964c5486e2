import { expect, test } from "vitest";
import { csvOf, vcdOf } from "./exports";
import type { Signal } from "./signals";

const lamp: Signal = { id: "table.IN3", label: "IN3", unit: "", controller: null, kind: "level", pin: "table.IN3" };
const volts: Signal = {
  id: "table.AIN1",
  label: "AIN1",
  unit: "V",
  controller: null,
  kind: "voltage",
  pin: "table.AIN1",
};
const value = (signal: Signal, at: bigint) =>
  signal === lamp ? (at < 500n ? 0 : 1) : at === 0n ? NaN : Number(at) / 1000;

test("CSV", () => {
  expect(csvOf([lamp, volts], value, 0n, 1000n, 3)).toBe(
    'time [s],"IN3","AIN1 [V]"\r\n0.000000000,0,\r\n0.000000500,1,0.5\r\n0.000001000,1,1\r\n',
  );
});

test("VCD has changes only", () => {
  expect(vcdOf([lamp, volts], value, 0n, 1000n, 3).split("\n")).toEqual([
    "$timescale 1 ns $end",
    "$scope module studio $end",
    "$var wire 1 ! table.IN3 $end",
    '$var real 64 " table.AIN1 $end',
    "$upscope $end",
    "$enddefinitions $end",
    "#0",
    "0!",
    'r0 "',
    "#500",
    "1!",
    'r0.5 "',
    "#1000",
    'r1 "',
    "#1000",
    "",
  ]);
});
