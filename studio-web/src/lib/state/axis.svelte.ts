import type { SubjectEvent } from "../protocol/types";
import type { AxisModel } from "./model";
import { Trajectory, type Motion, type Plan } from "./plan";

/** An interval of the past or present of an axis: its plan, and where the zero of its coordinate was. */
export interface Interval {
  from_ns: bigint;
  trajectory: Trajectory;
  /** Pulses by which the position shown is above that of the plan. */
  origin: number;
}

/** NaN is what is not known. */
export interface Sample {
  time_ns: bigint;
  position: number;
  velocity: number;
}

/** Of an axis of which nothing is known: it may move. */
const UNKNOWN = new Trajectory({ start_ns: "0", base: NaN, final: NaN, segments: [] });
/** Intervals and samples kept of each axis. */
const KEPT = 2000;

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
  readonly intervals: Interval[] = [];
  readonly samples: Sample[] = [];
  /** What held at a moment that is looked at: the page may not have been open then. */
  private past: Interval | null = null;

  constructor(readonly model: AxisModel) {}

  take(event: OfKind<"plan"> | OfKind<"coordinate"> | OfKind<"sample">): void {
    if (event.kind === "plan") this.plan(BigInt(event.time_ns), event.plan, event.origin);
    else if (event.kind === "coordinate") this.coordinate(BigInt(event.time_ns), event.origin);
    else this.sample(BigInt(event.time_ns), event.position ?? NaN, event.velocity ?? NaN);
    this.revision++;
  }

  /** All plans and coordinates between two moments in their order, instead of what is known of that time. */
  takeEarlier(events: readonly (OfKind<"plan"> | OfKind<"coordinate">)[], from_ns: bigint, to_ns: bigint): void {
    const earlier = new AxisState(this.model);
    earlier.intervals.push({ from_ns, trajectory: UNKNOWN, origin: NaN });
    for (const event of events) earlier.take(event);
    if (earlier.intervals.length === 1) return;
    const before = this.intervals.filter((one) => one.from_ns < from_ns);
    const found = earlier.intervals.filter((one) => one.from_ns < to_ns);
    const after = this.intervals.filter((one) => one.from_ns >= to_ns);
    this.intervals.splice(0, Infinity, ...[...before, ...found, ...after].slice(-KEPT));
    this.revision++;
  }

  /** What happens from a moment on is not known, until something is taken again. */
  lose(time_ns: bigint): void {
    if (this.intervals.length) this.add({ from_ns: time_ns, trajectory: UNKNOWN, origin: NaN });
    if (this.samples.length) this.sample(time_ns, NaN, NaN);
    this.revision++;
  }

  /** Time has gone back to `time_ns`: what was later has not happened. */
  forgetAfter(time_ns: bigint): void {
    cut(this.intervals, ({ from_ns }) => from_ns > time_ns);
    cut(this.samples, (sample) => sample.time_ns > time_ns);
    this.revision++;
  }

  /** In units of the axis. */
  at(now_ns: bigint): Motion {
    const interval = this.intervalAt(now_ns);
    if (interval !== null) {
      const scale = this.model.pulses_per_unit ?? 1;
      const { position, velocity } = interval.trajectory.at(now_ns);
      return { position: (position + interval.origin) / scale, velocity: velocity / scale };
    }
    const { position, velocity } = this.samples.at(-1) ?? { position: NaN, velocity: NaN };
    return { position, velocity };
  }

  /** As the controller shows it, in whole pulses, in units of the axis. */
  shown(now_ns: bigint): number {
    const interval = this.intervalAt(now_ns);
    if (interval === null) return this.at(now_ns).position;
    return (interval.trajectory.counted(now_ns) + interval.origin) / (this.model.pulses_per_unit ?? 1);
  }

  /** Pulses of the plan, from power-on. NaN where there are samples only. */
  pulses(now_ns: bigint): number {
    return this.intervalAt(now_ns)?.trajectory.at(now_ns).position ?? NaN;
  }

  /** Null where that is not known: it may move. */
  isMoving(now_ns: bigint): boolean | null {
    const interval = this.intervalAt(now_ns);
    if (interval !== null) return interval.trajectory === UNKNOWN ? null : interval.trajectory.isMoving(now_ns);
    const { velocity } = this.at(now_ns);
    return Number.isNaN(velocity) ? null : velocity !== 0;
  }

  /** Show the plan of a moment of the past; null: only what has been taken. */
  show(event: OfKind<"plan"> | null): void {
    this.past =
      event === null
        ? null
        : { from_ns: BigInt(event.time_ns), trajectory: new Trajectory(event.plan), origin: event.origin ?? 0 };
    this.revision++;
  }

  /** Moments at which motions begin and end, in no order. */
  *moments(): Iterable<bigint> {
    for (const { trajectory } of this.intervals) {
      if (trajectory.end_ns === trajectory.start_ns) continue;
      yield trajectory.start_ns;
      if (trajectory.end_ns !== null) yield trajectory.end_ns;
    }
  }

  /** What held at a moment; null where there are samples only, or nothing yet. */
  intervalAt(now_ns: bigint): Interval | null {
    if (this.past?.from_ns === now_ns) return this.past;
    return this.intervals[this.indexAt(now_ns)] ?? null;
  }

  /** Of the interval that held at a moment; the first one before there was any. */
  indexAt(time_ns: bigint): number {
    let low = 0;
    let high = this.intervals.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((this.intervals[middle] as Interval).from_ns <= time_ns) low = middle + 1;
      else high = middle;
    }
    return Math.max(0, low - 1);
  }

  private plan(time_ns: bigint, plan: Plan, origin: number | null): void {
    this.add({
      from_ns: time_ns,
      trajectory: new Trajectory(plan),
      origin: origin ?? this.intervals.at(-1)?.origin ?? 0,
    });
  }

  private coordinate(time_ns: bigint, origin: number): void {
    const last = this.intervals.at(-1);
    if (last !== undefined) this.add({ ...last, from_ns: time_ns, origin });
  }

  private add(interval: Interval): void {
    this.intervals.push(interval);
    if (this.intervals.length > KEPT) this.intervals.splice(0, KEPT / 10);
  }

  private sample(time_ns: bigint, position: number, velocity: number): void {
    this.samples.push({ time_ns, position, velocity });
    if (this.samples.length > KEPT) this.samples.splice(0, KEPT / 10);
  }
}
