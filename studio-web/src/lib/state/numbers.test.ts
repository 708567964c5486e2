import { expect, test } from "vitest";
import { whyNoNumber } from "./limits";
import { readNumber } from "./numbers";

test.each([
  ["12", 12],
  ["-0.5", -0.5],
  ["12,5", 12.5],
  ["−3", -3],
  ["1e3", 1000],
  ["0,125", 0.125],
  ["1.000", 1],
])("%s is a number", (text, value) => {
  expect(readNumber(text)).toBe(value);
});

test.each(["1,000", "-12,345", "1,000,000", "1_000", "1 000", "0x10", "１２", "1e999", "inf", ""])(
  "%s is none",
  (text) => {
    expect(readNumber(text)).toBeNull();
  },
);

test("a comma that may separate thousands is told with what to write", () => {
  expect(whyNoNumber("1,000")).toContain("1000");
  expect(whyNoNumber("1,000")).toContain("1.000");
  expect(whyNoNumber("x")).not.toContain("thousands");
});
