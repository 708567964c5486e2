import type { AxisState } from "./axis.svelte";

/** What is known of a load: where it is by the last value that came, in its unit, and whether its motor is stalled. */
export interface Seen {
  position: number | null | undefined;
  isStalled: boolean;
}

/** An axis has stood for so long when the value of its load is that of the place. [ns of virtual time] */
const STOOD_NS = 200_000_000n;

/**
 * Where a load is in each picture: while its drive moves it goes with the plan, by as much as it did when the drive stood last. A value that
 * has come is shown as it is where the load does not go with the pulses, and until the drive has stood once.
 */
export class Load {
  /** Of the value against the plan. [pulses] */
  offset = NaN;

  /** `pulses_per_unit`: of the load, negative where positive pulses go down. */
  constructor(private readonly pulses_per_unit: number) {}

  at(axis: AxisState | undefined, { position, isStalled }: Seen, now_ns: bigint): number {
    const seen = position ?? NaN;
    if (axis === undefined || isStalled) return seen;
    if (!axis.isMoving(now_ns)) {
      if (!axis.isMoving(now_ns - STOOD_NS)) this.offset = seen * this.pulses_per_unit - axis.pulses(now_ns);
      return seen;
    }
    const planned = this.planned(axis, now_ns);
    return Number.isNaN(planned) ? seen : planned;
  }

  /** With the drive, as at present: NaN until the drive has stood once, and before its first plan that is known. */
  planned(axis: AxisState, at_ns: bigint): number {
    const first = axis.intervals[0]?.from_ns;
    if (first === undefined || at_ns < first) return NaN;
    return (axis.pulses(at_ns) + this.offset) / this.pulses_per_unit;
  }
}
