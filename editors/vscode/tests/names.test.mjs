import assert from "node:assert/strict";
import { test } from "node:test";
import { load } from "./load.mjs";

const { expressionOf, namesIn } = await load("src/names.ts");
const TYPES = ["keyword", "variable", "number", "property", "macro", "label"];

test("variables, registers and constants, by absolute places", () => {
  // Lines and characters are relative: two tokens in line 1, one in line 1 further right, one in line 4.
  const data = [1, 4, 5, 1, 0, 0, 8, 2, 2, 0, 0, 6, 4, 3, 1, 3, 2, 3, 4, 0];
  assert.deepEqual(namesIn(new Uint32Array(data), TYPES), [
    { line: 1, start: 4, length: 5 },
    { line: 1, start: 18, length: 4 },
    { line: 4, start: 2, length: 3 },
  ]);
});

test("names of WBC are expressions, numbers of the M1486 need the letter before them", () => {
  assert.equal(expressionOf("wbc", "  count = n", { line: 0, start: 2, length: 5 }), "count");
  assert.equal(expressionOf("m1486", "I2H7", { line: 0, start: 1, length: 1 }), "B2");
  assert.equal(expressionOf("m1486", "t 1 2", { line: 0, start: 2, length: 3 }), "B12");
  assert.equal(expressionOf("m1486", "> 3", { line: 0, start: 2, length: 1 }), "register3");
});
