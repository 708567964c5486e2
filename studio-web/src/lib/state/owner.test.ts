import { expect, test } from "vitest";

import type { SubjectEvent } from "../protocol/types";
import { ownerOf } from "./owner";

const event = (facts: Record<string, string | number>): SubjectEvent => ({
  number: 1,
  time_ns: "5",
  controller: "cell",
  kind: "status",
  code: "workpiece",
  axis: null,
  facts,
  cause: null,
  text: "belt.1 is on belt",
});

test("an event of an element has its name, another one that of its controller", () => {
  expect(ownerOf(event({ workpiece: "belt.1", element: "belt" }))).toBe("belt");
  expect(ownerOf(event({}))).toBe("cell");
});
