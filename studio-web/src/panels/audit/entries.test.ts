import { expect, test } from "vitest";
import { chosen, csvOf, fieldsOf, type Entry } from "./entries";

const entry = (viewer: string, name: string, fields: Entry["fields"], outcome: Entry["outcome"]): Entry => ({
  at: "2026-03-01T12:00:00+00:00",
  time_ns: "1500000000",
  viewer,
  role: "operator",
  do: name,
  fields,
  outcome,
});
const moved = entry("piotr", "move", { controller: "table", axis: 1, to: 20 }, "done");
const refused = entry("hmi (OPC UA, 127.0.0.1:4)", "home", { controller: "drum" }, "refusal");

test("fields are said in a line", () => {
  expect(fieldsOf(moved)).toBe("controller table, axis 1, to 20");
});

test("the newest come first, and each word of the filter has to be somewhere", () => {
  expect(chosen([moved, refused], "", false)).toEqual([refused, moved]);
  expect(chosen([moved, refused], "Table PIOTR", false)).toEqual([moved]);
  expect(chosen([moved, refused], "table opc", false)).toEqual([]);
  expect(chosen([moved, refused], "", true)).toEqual([refused]);
});

test("a table for spreadsheets has no formulas and keeps quotes", () => {
  const rows = csvOf([entry('=1+1 "x"', "stop", {}, "done")]).split("\r\n");
  expect(rows[0]).toBe('"at","time_ns","viewer","role","do","fields","outcome"');
  expect(rows[1]).toBe(`"2026-03-01T12:00:00+00:00","1500000000","'=1+1 ""x""","operator","stop","","done"`);
  expect(rows).toHaveLength(3);
});
