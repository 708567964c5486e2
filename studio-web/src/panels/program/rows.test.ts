import { expect, test } from "vitest";
import { isName, numberText, rowOf, withRow } from "./rows";

test("a row has its name and values, x for what is left alone", () => {
  expect(rowOf("PICK", [1, null, -2.5, 0.30000001192092896])).toBe("PICK;1;x;-2.5;0.3");
  expect(numberText(0.0000001)).toBe("0");
  expect(numberText(1234567.8)).toBe("1234568");
});

test("a row takes the place of the one of its name, or comes to the end", () => {
  expect(withRow("HOME;1;x;x;x\nPICK;2;x;x;x\n", "pick", "pick;3;x;x;x")).toEqual(["HOME;1;x;x;x\npick;3;x;x;x\n", 2]);
  expect(withRow("HOME;1;x;x;x\n\n", "PICK", "PICK;3;x;x;x")).toEqual(["HOME;1;x;x;x\nPICK;3;x;x;x\n", 2]);
  expect(withRow("", "PICK", "PICK;3;x;x;x")).toEqual(["PICK;3;x;x;x\n", 1]);
});

test("names are those of the language", () => {
  expect(["PICK", "_a1"].map(isName)).toEqual([true, true]);
  expect(["", "1a", "a b", "ż", "a;b"].map(isName)).toEqual([false, false, false, false, false]);
});
