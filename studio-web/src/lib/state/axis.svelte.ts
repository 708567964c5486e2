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

export interface Sample {
  time_ns: bigint;
  position: number;
}

/** Stretches and samples kept of each axis. */
const KEPT = 5000;

type OfKind<K extends SubjectEvent["kind"]> = Extract<SubjectEvent, { kind: K }>;

/** Where an axis is. A twin's follows from its plan at any moment, a device's from its last sample. */
export class AxisState {
  /** Counts changes; a curve that has drawn this one is up to date. */
  revision = $state(0);
  readonly stretches: Stretch[] = [];
  readonly samples: Sample[] = [];

  constructor(readonly model: AxisModel) {}

  take(event: OfKind<"plan"> | OfKind<"coordinate"> | OfKind<"sample">): void {
    if (event.kind === "plan") this.plan(BigInt(event.time_ns), event.plan, event.origin);
    else if (event.kind === "coordinate") this.coordinate(BigInt(event.time_ns), event.origin);
    else this.sample(BigInt(event.time_ns), event.position);
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
    return { position: this.samples.at(-1)?.position ?? NaN, velocity: NaN };
  }

  /** As the controller shows it, in whole pulses, in units of the axis. */
  shown(now_ns: bigint): number {
    const stretch = this.stretchAt(now_ns);
    if (stretch === null) return this.at(now_ns).position;
    return (stretch.course.counted(now_ns) + stretch.origin) / (this.model.pulses_per_unit ?? 1);
  }

  isMoving(now_ns: bigint): boolean {
    return this.stretchAt(now_ns)?.course.isMoving(now_ns) ?? false;
  }

  /** What held at a moment; null where there are samples only, or nothing yet. */
  stretchAt(now_ns: bigint): Stretch | null {
    for (let index = this.stretches.length - 1; index >= 0; index--) {
      const stretch = this.stretches[index] as Stretch;
      if (stretch.from_ns <= now_ns || index === 0) return stretch;
    }
    return null;
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

  private sample(time_ns: bigint, position: number): void {
    this.samples.push({ time_ns, position });
    if (this.samples.length > KEPT) this.samples.splice(0, KEPT / 10);
  }
}
