import type { AxisState, Interval } from "../../lib/state/axis.svelte";

/** What a curve does in each column of a picture: its first and last value there and its extremes. NaN without any. */
export class Columns {
  readonly first: Float64Array;
  readonly last: Float64Array;
  readonly low: Float64Array;
  readonly high: Float64Array;

  constructor(readonly width: number) {
    [this.first, this.last, this.low, this.high] = [0, 0, 0, 0].map(() => new Float64Array(width).fill(NaN)) as [
      Float64Array,
      Float64Array,
      Float64Array,
      Float64Array,
    ];
  }

  clear(): void {
    for (const values of [this.first, this.last, this.low, this.high]) values.fill(NaN);
  }

  /** Values of one column come in the order of time; what is not known is left out. */
  add(column: number, value: number): void {
    if (!(column >= 0 && column < this.width) || Number.isNaN(value)) return;
    if (Number.isNaN(this.first[column])) {
      this.first[column] = this.low[column] = this.high[column] = value;
    } else {
      this.low[column] = Math.min(this.low[column] as number, value);
      this.high[column] = Math.max(this.high[column] as number, value);
    }
    this.last[column] = value;
  }

  /** The extremes of the whole picture; NaN where there is nothing. */
  range(): [number, number] {
    let [low, high] = [NaN, NaN];
    for (let column = 0; column < this.width; column++) {
      const [from, to] = [this.low[column] as number, this.high[column] as number];
      if (!(from >= low)) low = Number.isNaN(from) ? low : from;
      if (!(to <= high)) high = Number.isNaN(to) ? high : to;
    }
    return [low, high];
  }
}

export type Quantity = "position" | "velocity";

/**
 * Fills columns with the curve of an axis, computed from its plans: at both ends of each column and at each end of a segment between them.
 * A device has samples, which are joined by lines.
 */
export function fill(
  columns: Columns,
  axis: AxisState,
  quantity: Quantity,
  from_ns: bigint,
  span_ns: bigint,
  now_ns: bigint,
): void {
  columns.clear();
  if (axis.intervals.length) fillFromPlans(columns, axis, quantity, from_ns, span_ns, now_ns);
  else if (quantity === "position") fillFromSamples(columns, axis, from_ns, span_ns);
}

function fillFromPlans(
  columns: Columns,
  axis: AxisState,
  quantity: Quantity,
  from_ns: bigint,
  span_ns: bigint,
  now_ns: bigint,
): void {
  const scale = axis.model.pulses_per_unit ?? 1;
  const perColumn = Number(span_ns) / columns.width;
  const until = Math.min(Number(span_ns), Number(now_ns - from_ns));
  for (let index = axis.indexAt(from_ns); index < axis.intervals.length; index++) {
    const { from_ns: begin_ns, trajectory, origin } = axis.intervals[index] as Interval;
    const next = axis.intervals[index + 1];
    const begin = Math.max(0, Number(begin_ns - from_ns));
    const end = Math.min(until, next === undefined ? Infinity : Number(next.from_ns - from_ns));
    if (begin > until) return;
    if (end < begin) continue;
    const start = Number(trajectory.start_ns - from_ns);
    const value = (at: number): number => {
      const motion = trajectory.atSeconds((at - start) / 1e9);
      return (quantity === "position" ? motion.position + origin : motion.velocity) / scale;
    };
    const put = (at: number): void => columns.add(Math.min(columns.width - 1, Math.floor(at / perColumn)), value(at));
    const corners = trajectory.corners_s.map((corner) => start + corner * 1e9).filter((at) => at > begin && at < end);
    let corner = 0;
    put(begin);
    for (let column = Math.floor(begin / perColumn) + 1; column * perColumn < end; column++) {
      while (corner < corners.length && (corners[corner] as number) <= column * perColumn)
        put(corners[corner++] as number);
      const there = value(column * perColumn);
      columns.add(column - 1, there);
      columns.add(column, there);
    }
    while (corner < corners.length) put(corners[corner++] as number);
    put(end);
  }
}

function fillFromSamples(columns: Columns, axis: AxisState, from_ns: bigint, span_ns: bigint): void {
  const perColumn = Number(span_ns) / columns.width;
  let before: [number, number] | null = null;
  for (const { time_ns, position } of axis.samples) {
    const at = Number(time_ns - from_ns);
    if (Number.isNaN(position)) {
      before = null;
      continue;
    }
    if (before !== null && at >= 0 && before[0] <= Number(span_ns)) {
      const [began, from] = before;
      const first = Math.max(0, Math.ceil(began / perColumn));
      const last = Math.min(columns.width - 1, Math.floor(at / perColumn));
      for (let column = first; column <= last; column++) {
        columns.add(column, from + ((position - from) * (column * perColumn - began)) / (at - began || 1));
      }
    }
    if (at >= 0) columns.add(Math.floor(at / perColumn), position);
    before = [at, position];
  }
}

/** Values looked at in each column of a curve that has no plan of its own. */
const LOOKS = 8n;

/** Fills columns with what changes too quickly to be followed: with the values at some moments of each. */
export function fillFrom(
  columns: Columns,
  value: (time_ns: bigint) => number,
  from_ns: bigint,
  span_ns: bigint,
  now_ns: bigint,
): void {
  columns.clear();
  const looks = BigInt(columns.width) * LOOKS;
  for (let look = 0n; look < looks; look++) {
    const at = from_ns + (span_ns * look) / looks;
    if (at > now_ns) return;
    const found = value(at);
    if (!Number.isNaN(found)) columns.add(Number(look / LOOKS), found);
  }
}
