import type { Point } from "./model";

/** What a controller or an axis is in, for its mark: a shape and a colour beside the word. */
export type Condition = Point["conditions"][string] | "unknown";

/** Of a value of a status, as its data sheet has it, and its words there. */
export function conditionOf(point: Point | undefined, value: number | null | undefined): [Condition, string] {
  if (point === undefined || value === null || value === undefined) return ["unknown", ""];
  return [point.conditions[String(value)] ?? "rest", point.values[String(value)] ?? String(value)];
}
