import type { SubjectEvent } from "../protocol/types";

/** Events that people read; the others are as frequent as requests. */
const SHOWN = new Set<SubjectEvent["kind"]>(["status", "note", "report", "button", "input", "fault", "pace"]);
const KEPT = 1000;

export type Severity = "plain" | "warning" | "alarm";

/** Codes of data sheets that say that something is wrong; `-error`, `-failure` and `-failed` are others by their ends. */
const ALARMS = new Set(["overdue", "expectation", "wrong-data", "file-refused", "path-left", "overrun"]);
const WARNINGS = new Set(["limit", "drive-off", "speed-clamped", "trigger-empty", "frame-pause", "shutdown"]);

export function severityOf(event: SubjectEvent): Severity {
  if (event.kind === "fault") return "warning";
  if (event.kind !== "status" && event.kind !== "report") return "plain";
  if (ALARMS.has(event.code) || /-(error|failure|failed)$/.test(event.code)) return "alarm";
  return WARNINGS.has(event.code) ? "warning" : "plain";
}

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

  take(events: readonly SubjectEvent[]): void {
    const news = events.filter(isShown);
    if (!news.length) return;
    this.alarms += news.filter((event) => severityOf(event) === "alarm").length;
    this.list = [...news.reverse(), ...this.list].slice(0, KEPT);
  }
}
