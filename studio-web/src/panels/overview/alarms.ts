import { severityOf, type Severity } from "../../lib/state/events.svelte";
import type { SubjectEvent } from "../../lib/protocol/types";

/** An alarm, and how often it came: the same machine, code and axis. */
export interface Alarm {
  key: string;
  severity: Severity;
  count: number;
  last: SubjectEvent;
}

/** Whether the motor of an axis stops with it, by code; others do it or not. */
export const STOPS: Readonly<Record<string, boolean>> = {
  limit: true,
  "position-error": true,
  "drive-off": true,
  overrun: false,
  "speed-clamped": false,
  "trigger-empty": false,
  "frame-pause": false,
  "wrong-data": false,
  "memory-failure": false,
};

const codeOf = (event: SubjectEvent): string => ("code" in event ? event.code : event.kind);
const axisOf = (event: SubjectEvent): string => (event.kind === "status" ? (event.axis ?? "") : "");

/** Warnings and alarms, the newest first; events come newest first. */
export function alarmsOf(events: readonly SubjectEvent[]): Alarm[] {
  const found = new Map<string, Alarm>();
  for (const event of events) {
    const severity = severityOf(event);
    if (severity === "plain") continue;
    const key = `${event.machine} ${codeOf(event)} ${axisOf(event)}`;
    const known = found.get(key);
    if (known === undefined) found.set(key, { key, severity, count: 1, last: event });
    else known.count++;
  }
  return [...found.values()];
}

export const stopsMotor = (event: SubjectEvent): boolean | undefined => STOPS[codeOf(event)];
