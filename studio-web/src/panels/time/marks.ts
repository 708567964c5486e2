import type { SubjectEvent } from "../../lib/protocol/types";
import type { Severity } from "../../lib/state/severity";
import type { View } from "../scope/view";

export const LANES = ["alarms", "faults", "workpieces", "others"] as const;
export type Lane = (typeof LANES)[number];

export function laneOf(event: SubjectEvent, severity: Severity): Lane {
  if (event.kind === "fault") return "faults";
  if (severity !== "information") return "alarms";
  return event.kind === "status" && event.facts.workpiece !== undefined ? "workpieces" : "others";
}

/** One event, or several that lie too near to each other to be told apart. */
export interface Mark {
  x: number;
  events: SubjectEvent[];
}

/** Nearer ones share a mark. [pixels] */
const APART = 7;

export const xOf = (time_ns: bigint, { from_ns, span_ns }: View, width: number): number =>
  (Number(time_ns - from_ns) / Number(span_ns)) * width;

/** Events that come newest first, from left to right; only those in view. */
export function marksOf(events: readonly SubjectEvent[], view: View, width: number): Mark[] {
  const marks: Mark[] = [];
  for (const event of [...events].reverse()) {
    const x = xOf(BigInt(event.time_ns), view, width);
    if (x < 0 || x > width) continue;
    const last = marks.at(-1);
    if (last !== undefined && x - last.x < APART) last.events.push(event);
    else marks.push({ x, events: [event] });
  }
  return marks;
}

/** The worlds from which a branch comes, the first one first: `demo, branch 1 from 3 s, branch 2 from 4 s`. */
export function ancestry(name: string): string[] {
  const parts = name.split(/, (?=branch \d+ from [\d.]+ s)/);
  return parts.map((_, index) => parts.slice(0, index + 1).join(", "));
}
