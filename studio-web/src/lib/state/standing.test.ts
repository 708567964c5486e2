import { expect, test } from "vitest";
import type { ControllerModel } from "./model";
import { standingOf, standingWith, type Standing } from "./standing";

const names = (standing: readonly Standing[]) => standing.map(({ name }) => name);

test("what stands of a thing is that of its parts, too, and not that of things whose names begin alike", () => {
  const all = ["table", "table.M1", "table2", "x", "y"].map((name) => ({ name }) as Standing);
  const table = { name: "table", axes: [{ mechanics: "x" }, { mechanics: "" }] } as unknown as ControllerModel;
  expect(names(standingOf(all, "table"))).toEqual(["table", "table.M1"]);
  expect(names(standingWith(all, table))).toEqual(["table", "table.M1", "x"]);
});
