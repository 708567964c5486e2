import { expect, test } from "vitest";
import type { Datasheet, Point } from "../../lib/state/model";
import { blockRows, groupOf, isMeant, isTrigger, rowsOf, shownAddress } from "./rows";

function point(path: string, space: string, place: number | string, words = 1, more: Partial<Point> = {}): Point {
  return {
    path,
    meaning: `Meaning of ${path}.`,
    type: "number",
    unit: "",
    limits: null,
    values: {},
    conditions: {},
    access: "rw",
    effect: "parameter",
    addresses: [{ space, place, words, type: "WORD" }],
    source: "3.2",
    ...more,
  };
}

const POSITION = point("M1_POS_ACT", "holding register", 10020, 2);
const USER = point("USER_REGISTER", "holding register", 0, 2000);

test("addresses count from 0, from 1, or have the digit of their space", () => {
  expect(shownAddress(POSITION, "base0")).toBe("10020");
  expect(shownAddress(POSITION, "base1")).toBe("10021");
  expect(shownAddress(POSITION, "modicon")).toBe("410021");
  expect(shownAddress(USER, "modicon")).toBe("40001");
  expect(shownAddress(point("OUT1", "coil", 6000), "modicon")).toBe("06001");
  expect(shownAddress(point("IN1", "input", 5000), "modicon")).toBe("15001");
  expect(shownAddress(point("register1", "command", "<1"), "base1")).toBe("<1");
});

test("a point is found by its name, its meaning, and its address in any form", () => {
  const row = { path: "M1_POS_ACT", point: POSITION, group: "M1" };
  for (const typed of ["", " pos_a", "meaning of m1", "10020", "10021", "410021"])
    expect(isMeant(row, typed)).toBe(true);
  for (const typed of ["10022", "1002", "M2"]) expect(isMeant(row, typed)).toBe(false);
});

test("points belong to their axis, blocks have a view of their own", () => {
  const sheet = { axes: [{ name: "M1" }, { name: "M2" }], points: [POSITION, USER] } as unknown as Datasheet;
  expect(rowsOf(sheet).map(({ path, group }) => [path, group])).toEqual([["M1_POS_ACT", "M1"]]);
  expect(groupOf("M1.position", sheet)).toBe("M1");
  expect(groupOf("M_STATUS", sheet)).toBe("");
});

test("user registers as words, and in pairs as DINT and REAL", () => {
  const paths = (type: string, first: number) => blockRows(USER, first, type, 3).map(({ path }) => path);
  expect(paths("WORD", 5)).toEqual(["USER_REGISTER[5]", "USER_REGISTER[6]", "USER_REGISTER[7]"]);
  expect(paths("REAL", 5)).toEqual(["USER_REGISTER[4]:real", "USER_REGISTER[6]:real", "USER_REGISTER[8]:real"]);
  expect(paths("DINT", 1998)).toEqual(["USER_REGISTER[1998]:dint"]);
  expect(blockRows(USER, 4, "INT", 1)[0]?.point.limits).toEqual({ low: -32768, high: 32767, is_low_excluded: false });
});

test("what can only be switched on is a trigger", () => {
  expect(isTrigger(point("M1_STOP", "coil", 2004, 1, { access: "w", type: "switch", effect: "acts" }))).toBe(true);
  expect(isTrigger(point("M1_EN", "coil", 2000, 1, { access: "w", type: "switch", effect: "parameter" }))).toBe(false);
});
