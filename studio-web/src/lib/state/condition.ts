import type { Point } from "./model";

/** What a controller or an axis is in, for its mark: a shape and a colour beside the word. */
export type Condition = "off" | "rest" | "moving" | "warning" | "error" | "unknown";

/** Of a value of a status in the words of its data sheet. */
export function conditionOf(point: Point | undefined, value: number | null | undefined): [Condition, string] {
  if (point === undefined || value === null || value === undefined) return ["unknown", ""];
  const words = point.values[String(value)] ?? String(value);
  if (/error/i.test(words)) return ["error", words];
  if (/limit/i.test(words)) return ["warning", words];
  if (/^off$/i.test(words)) return ["off", words];
  if (/moving|homing|mode|correction/i.test(words)) return ["moving", words];
  return ["rest", words];
}
