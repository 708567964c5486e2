import type { SubjectEvent } from "../protocol/types";
import type { Severity } from "./severity";

/** Events that people read; the others are as frequent as requests. */
const SHOWN = new Set<SubjectEvent["kind"]>([
  "status",
  "note",
  "report",
  "button",
  "input",
  "fault",
  "pace",
  "restored",
]);
const KEPT = 1000;

export function isShown(event: SubjectEvent): boolean {
  return SHOWN.has(event.kind) && !(event.kind === "input" && event.what === "request");
}

/** What has happened, newest first. */
export class EventLog {
  list = $state.raw<readonly SubjectEvent[]>([]);
  /** Alarms since they were last looked at. */
  alarms = $state(0);
  /** Events that were dropped on the way. */
  missed = $state(0);
  /** While there was no connection: from when and until when. */
  unknown = $state.raw<readonly [bigint, bigint] | null>(null);

  constructor(private readonly severity: (event: SubjectEvent) => Severity) {}

  *moments(): Iterable<bigint> {
    for (const event of this.list) yield BigInt(event.time_ns);
  }

  take(events: readonly SubjectEvent[]): void {
    const news = events.filter(isShown);
    if (!news.length) return;
    this.alarms += news.filter((event) => this.severity(event) === "alarm").length;
    this.list = [...news.reverse(), ...this.list].slice(0, KEPT);
  }
}
