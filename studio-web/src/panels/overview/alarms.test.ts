import { expect, test } from "vitest";
import type { SubjectEvent } from "../../lib/protocol/types";
import { alarmsOf } from "./alarms";

const limit = (number: number, axis: string): SubjectEvent => ({
  number,
  time_ns: String(number),
  controller: "table",
  kind: "status",
  code: "limit",
  axis,
  facts: {},
  cause: null,
  text: `axis ${axis}`,
});

test("alarms of one axis are one row with their count and the newest of them", () => {
  const homed: SubjectEvent = { ...limit(4, "1"), kind: "status", code: "homed" } as SubjectEvent;
  const rows = alarmsOf([limit(9, "1"), limit(7, "2"), homed, limit(3, "1")], (event) =>
    "code" in event && event.code === "limit" ? "warning" : "information",
  );
  expect(rows.map(({ count, last }) => [count, last.number])).toEqual([
    [2, 9],
    [1, 7],
  ]);
  expect(rows[0]?.severity).toBe("warning");
});
