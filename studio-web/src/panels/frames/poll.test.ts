import { expect, test } from "vitest";
import type { Datasheet } from "../../lib/state/model";
import { bytesOf, type Frame } from "./frame";
import { askedBy, isPolled, keyOf, pduOf } from "./poll";

const point = (path: string, space: string, place: number, words: number, access = "rw") => ({
  path,
  access,
  addresses: [{ space, place, words, type: "" }],
});
const SHEET = {
  points: [
    point("M1_POS_ACT", "holding register", 10020, 2),
    point("M1_MOVING", "coil", 2010, 1, "r"),
    point("IN1", "input", 3000, 1, "r"),
    point("M1_EN", "coil", 2000, 1, "w"),
  ],
} as unknown as Datasheet;

test("a request is meant by its bytes, or by the name of what it reads", () => {
  expect(pduOf(" m1_pos_act ", SHEET)).toBe("0327240002");
  expect(pduOf("M1_MOVING", SHEET)).toBe("0107da0001");
  expect(pduOf("IN1", SHEET)).toBe("020bb80001");
  expect(pduOf("03 27,24 0x00 02", SHEET)).toBe("0327240002");
  for (const wrong of ["M1_EN", "M9", "03 2", ""]) expect(pduOf(wrong, SHEET)).toBeNull();
});

test("a request is found again on both kinds of lines", () => {
  const row = { line: "bus", unit: 1, pdu: "0327240002" };
  const serial = "01 03 27 24 00 02 8e b4".replaceAll(" ", "");
  const tcp = "00 01 00 00 00 06 01 03 27 24 00 02".replaceAll(" ", "");
  for (const hex of [serial, tcp]) expect(askedBy({ line: "bus", data: bytesOf(hex) } as Frame)).toBe(keyOf(row));
});

test("a list of another form is left out", () => {
  expect(isPolled([{ line: "bus", unit: 1, pdu: "03" }])).toBe(true);
  for (const wrong of [{}, [{ line: "bus", unit: "1", pdu: "03" }], Array(21).fill({ line: "b", unit: 1, pdu: "03" })])
    expect(isPolled(wrong)).toBe(false);
});
