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
/** With those of the time before that were asked for. */
const MOST = 5000;

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

  /** From here on they are all there, but for `unknown`. */
  known_ns = $state.raw(0n);

  forget(): void {
    this.list = [];
    this.unknown = null;
  }

  /** The newest events, the oldest of them first, which are all from a moment on. Those that the page has heard go up to `heard_ns`. */
  begin(events: readonly SubjectEvent[], from_ns: bigint, heard_ns: bigint): void {
    const before = this.list.filter((event) => BigInt(event.time_ns) < from_ns);
    if (!before.length) this.known_ns = from_ns;
    this.unknown = before.length && heard_ns < from_ns ? [heard_ns, from_ns] : null;
    this.list = [...events.filter(isShown).reverse(), ...before];
  }

  /** All of a time that begins there; of those that are known already nothing is taken. */
  takeEarlier(events: readonly SubjectEvent[], from_ns: bigint): void {
    const news = events.filter((event) => isShown(event) && BigInt(event.time_ns) < this.known_ns);
    this.list = [...this.list, ...news.reverse()].slice(0, MOST);
    if (from_ns < this.known_ns) this.known_ns = from_ns;
  }

  *moments(): Iterable<bigint> {
    for (const event of this.list) yield BigInt(event.time_ns);
  }

  take(events: readonly SubjectEvent[]): void {
    const news = events.filter(isShown);
    if (!news.length) return;
    this.alarms += news.filter((event) => this.severity(event) === "alarm").length;
    const list = [...news.reverse(), ...this.list];
    this.list = list.length > MOST ? list.slice(0, KEPT) : list;
  }
}
