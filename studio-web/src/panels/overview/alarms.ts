import type { SubjectEvent } from "../../lib/protocol/types";
import { ownerOf } from "../../lib/state/owner";
import type { Severity } from "../../lib/state/severity";

/** An alarm, and how often it came: the same controller, code and axis. */
export interface Alarm {
  key: string;
  severity: Severity;
  count: number;
  last: SubjectEvent;
}

const codeOf = (event: SubjectEvent): string => ("code" in event ? event.code : event.kind);
const axisOf = (event: SubjectEvent): string => (event.kind === "status" ? (event.axis ?? "") : "");

/** Warnings and alarms, the newest first; events come newest first. */
export function alarmsOf(events: readonly SubjectEvent[], severityOf: (event: SubjectEvent) => Severity): Alarm[] {
  const found = new Map<string, Alarm>();
  for (const event of events) {
    const severity = severityOf(event);
    if (severity === "information") continue;
    const key = `${ownerOf(event)} ${codeOf(event)} ${axisOf(event)}`;
    const known = found.get(key);
    if (known === undefined) found.set(key, { key, severity, count: 1, last: event });
    else known.count++;
  }
  return [...found.values()];
}
