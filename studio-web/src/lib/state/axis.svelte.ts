import type { SubjectEvent } from "../protocol/types";
import type { AxisModel } from "./model";
import { Course, type Motion, type Plan } from "./plan";

/** A stretch of the past or present of an axis: its plan, and where the zero of its coordinate was. */
export interface Stretch {
  from_ns: bigint;
  course: Course;
  /** Pulses by which the position shown is above that of the plan. */
  origin: number;
}

/** NaN is what is not known. */
export interface Sample {
  time_ns: bigint;
  position: number;
  velocity: number;
}

/** Stretches and samples kept of each axis. */
const KEPT = 5000;

type OfKind<K extends SubjectEvent["kind"]> = Extract<SubjectEvent, { kind: K }>;

/** Ends a list before the first element for which `isLate` holds. */
function cut<T>(list: T[], isLate: (element: T) => boolean): void {
  const first = list.findIndex(isLate);
  if (first >= 0) list.length = first;
}

/** Where an axis is. A twin's follows from its plan at any moment, a device's from its last sample. */
export class AxisState {
  /** Counts changes; a curve that has drawn this one is up to date. */
  revision = $state(0);
  readonly stretches: Stretch[] = [];
  readonly samples: Sample[] = [];
  /** What held at a moment that is looked at: the page may not have been open then. */
  private past: Stretch | null = null;

  constructor(readonly model: AxisModel) {}

  take(event: OfKind<"plan"> | OfKind<"coordinate"> | OfKind<"sample">): void {
    if (event.kind === "plan") this.plan(BigInt(event.time_ns), event.plan, event.origin);
    else if (event.kind === "coordinate") this.coordinate(BigInt(event.time_ns), event.origin);
    else this.sample(BigInt(event.time_ns), event.position ?? NaN, event.velocity ?? NaN);
    this.revision++;
  }

  /** What was before: plans and coordinates in their order, the first of them from the begin. */
  takeEarlier(events: readonly (OfKind<"plan"> | OfKind<"coordinate">)[]): void {
    const earlier = new AxisState(this.model);
    for (const event of events) earlier.take(event);
    const first = this.stretches[0]?.from_ns;
    const found = earlier.stretches.filter(({ from_ns }) => first === undefined || from_ns < first);
    this.stretches.unshift(...found.slice(Math.max(0, found.length + this.stretches.length - KEPT)));
    this.revision++;
  }

  /** Time has gone back to `time_ns`: what was later has not happened. */
  forgetAfter(time_ns: bigint): void {
    cut(this.stretches, ({ from_ns }) => from_ns > time_ns);
    cut(this.samples, (sample) => sample.time_ns > time_ns);
    this.revision++;
  }

  /** In units of the axis. */
  at(now_ns: bigint): Motion {
    const stretch = this.stretchAt(now_ns);
    if (stretch !== null) {
      const scale = this.model.pulses_per_unit ?? 1;
      const { position, velocity } = stretch.course.at(now_ns);
      return { position: (position + stretch.origin) / scale, velocity: velocity / scale };
    }
    const { position, velocity } = this.samples.at(-1) ?? { position: NaN, velocity: NaN };
    return { position, velocity };
  }

  /** As the controller shows it, in whole pulses, in units of the axis. */
  shown(now_ns: bigint): number {
    const stretch = this.stretchAt(now_ns);
    if (stretch === null) return this.at(now_ns).position;
    return (stretch.course.counted(now_ns) + stretch.origin) / (this.model.pulses_per_unit ?? 1);
  }

  /** Pulses of the plan, from power-on. NaN where there are samples only. */
  pulses(now_ns: bigint): number {
    return this.stretchAt(now_ns)?.course.at(now_ns).position ?? NaN;
  }

  /** Null where that is not known: it may move. */
  isMoving(now_ns: bigint): boolean | null {
    const stretch = this.stretchAt(now_ns);
    if (stretch !== null) return stretch.course.isMoving(now_ns);
    const { velocity } = this.at(now_ns);
    return Number.isNaN(velocity) ? null : velocity !== 0;
  }

  /** Show the plan of a moment of the past; null: only what has been taken. */
  show(event: OfKind<"plan"> | null): void {
    this.past =
      event === null
        ? null
        : { from_ns: BigInt(event.time_ns), course: new Course(event.plan), origin: event.origin ?? 0 };
    this.revision++;
  }

  /** Moments at which motions begin and end, in no order. */
  *moments(): Iterable<bigint> {
    for (const { course } of this.stretches) {
      if (course.end_ns === course.start_ns) continue;
      yield course.start_ns;
      if (course.end_ns !== null) yield course.end_ns;
    }
  }

  /** What held at a moment; null where there are samples only, or nothing yet. */
  stretchAt(now_ns: bigint): Stretch | null {
    if (this.past?.from_ns === now_ns) return this.past;
    return this.stretches[this.indexAt(now_ns)] ?? null;
  }

  /** Of the stretch that held at a moment; the first one before there was any. */
  indexAt(time_ns: bigint): number {
    let [low, high] = [0, this.stretches.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((this.stretches[middle] as Stretch).from_ns <= time_ns) low = middle + 1;
      else high = middle;
    }
    return Math.max(0, low - 1);
  }

  private plan(time_ns: bigint, plan: Plan, origin: number | null): void {
    this.add({ from_ns: time_ns, course: new Course(plan), origin: origin ?? this.stretches.at(-1)?.origin ?? 0 });
  }

  private coordinate(time_ns: bigint, origin: number): void {
    const last = this.stretches.at(-1);
    if (last !== undefined) this.add({ ...last, from_ns: time_ns, origin });
  }

  private add(stretch: Stretch): void {
    this.stretches.push(stretch);
    if (this.stretches.length > KEPT) this.stretches.splice(0, KEPT / 10);
  }

  private sample(time_ns: bigint, position: number, velocity: number): void {
    this.samples.push({ time_ns, position, velocity });
    if (this.samples.length > KEPT) this.samples.splice(0, KEPT / 10);
  }
}
