import { expect, test } from "vitest";
import type { Datasheet, Point } from "../../lib/state/model";
import { rowsOf } from "./rows";
import { readTags, tagList } from "./tags";

const point = (path: string, space: string, place: number | string, words: number, type: string): Point =>
  ({
    path,
    meaning: "What, and why.",
    type: "number",
    unit: "",
    limits: null,
    values: {},
    access: "rw",
    effect: "parameter",
    addresses: [{ space, place, words, type }],
    source: "",
  }) as unknown as Point;

const SHEET = {
  axes: [{ name: "M1" }],
  points: [
    point("OUT1", "coil", 6000, 1, "BIT"),
    point("M1_POS_ACT", "holding register", 10020, 2, "REAL/DINT"),
    point("register1", "command", "<1", 1, ""),
    point("USER_REGISTER", "holding register", 0, 2000, "WORD/DINT/REAL"),
  ],
} as unknown as Datasheet;

const paths = (text: string) => readTags(text, SHEET).rows.map(({ path }) => path);

test("a list has the columns of the command line, and is read back", () => {
  const text = tagList(rowsOf(SHEET));
  expect(text.split("\n").slice(0, 3)).toEqual([
    "tag,data_type,access,area,address_0,address_1,reference,registers,word_order,unit,minimum,maximum,comment",
    'OUT1,BOOL,RW,0x coil,6000,6001,006001,1,,,,,"What, and why."',
    'M1_POS_ACT,REAL,RW,4x holding register,10020,10021,410021,2,low word first,,,,"What, and why."',
  ]);
  expect(paths(text)).toEqual(["OUT1", "M1_POS_ACT"]);
});

test("tags of other programs are found by address and type, user registers too", () => {
  const text = "Tag;Address_0;Data_type\r\nPump;6000;BOOL\r\nLevel;12;REAL\r\nCount;13;INT\r\n;10020;REAL\r\n";
  expect(paths(text)).toEqual(["OUT1", "USER_REGISTER[12]:real", "USER_REGISTER[13]:int", "M1_POS_ACT"]);
});

test("user registers by name; what is not there is told; nothing comes twice", () => {
  const found = readTags(
    "tag\nuser_register[4]:dint\nUSER_REGISTER[2000]\nUSER_REGISTER[5]:real\nM9\nOUT1\nout1\n",
    SHEET,
  );
  expect(found.rows.map(({ path }) => path)).toEqual(["USER_REGISTER[4]:dint", "OUT1"]);
  expect(found.unknown).toEqual(["USER_REGISTER[2000]", "USER_REGISTER[5]:real", "M9"]);
});

test("a text without these columns is no tag list", () => {
  expect(() => readTags("a,b\n1,2\n", SHEET)).toThrow();
  expect(() => readTags("", SHEET)).toThrow();
});
