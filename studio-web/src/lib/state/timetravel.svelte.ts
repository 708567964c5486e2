import { RequestError } from "../protocol/connection";
import type { PastMessage, SubjectEvent } from "../protocol/types";
import { nearest } from "./moments";
import type { Ask } from "./watch.svelte";

export type Past = NonNullable<PastMessage["past"]>;
type PlanEvent = Extract<SubjectEvent, { kind: "plan" }>;

/** What shows a moment of the past, and where moments are at which something happened. */
export interface Shown {
  /** Null: the present again. */
  show(past: Past | null): void;
  moments(): Iterable<bigint>;
  present(): bigint;
  report(error: unknown): void;
}

const ANSWER_MS = 60_000;
/** A step where nothing is known to have happened. */
const STEP_NS = 1_000_000_000n;

/** The moment that the page shows: one for all its panels. */
export class TimeTravel {
  /** What the page wants to show; null: the present. */
  moment = $state.raw<bigint | null>(null);
  /** What the studio has answered; of another moment until the next answer. */
  past = $state.raw<Past | null>(null);
  private isAsking = false;

  constructor(
    private readonly ask: Ask,
    private readonly shown: Shown,
  ) {}

  /** Every panel shows this moment. One that is not there yet is the present. */
  go(time_ns: bigint): void {
    const present = this.shown.present();
    this.moment = time_ns < 0n ? 0n : time_ns > present ? present : time_ns;
    void this.showMoment();
  }

  live(): void {
    if (this.moment === null) return;
    this.moment = null;
    void this.showMoment();
  }

  /** To the moment at which something happened last before, or next; behind the last one is the present. */
  step(direction: -1 | 1): void {
    const from = this.moment ?? this.shown.present();
    const found = nearest(this.shown.moments(), from, direction);
    if (found !== null) this.go(found);
    else if (direction < 0) this.go(from - STEP_NS);
    else this.live();
  }

  take(past: Past | null): void {
    this.past = past;
    this.shown.show(past);
  }

  /** The present is shown whatever was wanted: the studio knows of no other moment. */
  forget(): void {
    this.moment = null;
    this.take(null);
  }

  /** Moments are asked for one after the other; of those that were wanted meanwhile only the last. */
  private async showMoment(): Promise<void> {
    if (this.isAsking) return;
    this.isAsking = true;
    try {
      let asked: bigint | null | undefined;
      while (asked !== this.moment) {
        asked = this.moment;
        await this.ask("show_moment", { to_ns: asked === null ? null : String(asked) }, ANSWER_MS);
      }
    } catch (error) {
      if (!(error instanceof RequestError && error.code === "closed")) this.shown.report(error);
      this.moment = this.past === null ? null : BigInt(this.past.time_ns);
    } finally {
      this.isAsking = false;
    }
  }
}

/** The plans of a past. */
export function plansOf(past: Past): PlanEvent[] {
  return past.plans.filter((event): event is PlanEvent => event.kind === "plan");
}
