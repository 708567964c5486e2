/** The part of time that the scope shows. All moments in ns of virtual time. */

export const SHORTEST_NS = 1_000n;
export const LONGEST_NS = 86_400_000_000_000n;

const clamp = (value: bigint, low: bigint, high: bigint): bigint => (value < low ? low : value > high ? high : value);
const part = (whole: bigint, fraction: number): bigint => BigInt(Math.round(Number(whole) * fraction));

export interface View {
  from_ns: bigint;
  span_ns: bigint;
}

export class TimeView {
  span_ns = 10_000_000_000n;
  /** The right end; null follows the present. */
  private end_ns: bigint | null = null;

  get isLive(): boolean {
    return this.end_ns === null;
  }

  at(now_ns: bigint): View {
    return { from_ns: (this.end_ns ?? now_ns) - this.span_ns, span_ns: this.span_ns };
  }

  follow(): void {
    this.end_ns = null;
  }

  hold(now_ns: bigint): void {
    this.end_ns ??= now_ns;
  }

  /** By a fraction of what is shown; to the right it ends at the present and follows it. */
  pan(fraction: number, now_ns: bigint): void {
    const end = (this.end_ns ?? now_ns) + part(this.span_ns, fraction);
    this.end_ns = end >= now_ns ? null : end < 0n ? 0n : end;
  }

  /** `factor` above 1 shows less. What is at the fraction `where` of the width stays there; a view that follows keeps its right end. */
  zoom(factor: number, where: number, now_ns: bigint): void {
    const span = clamp(part(this.span_ns, 1 / factor), SHORTEST_NS, LONGEST_NS);
    if (this.end_ns !== null) {
      const end = this.end_ns + part(span - this.span_ns, 1 - where);
      this.end_ns = end > now_ns ? now_ns : end;
    }
    this.span_ns = span;
  }

  /** A moment in the middle, at rest. */
  centre(time_ns: bigint): void {
    this.end_ns = time_ns + this.span_ns / 2n;
  }
}

/** Steps of 1, 2 and 5 × 10ⁿ, so that there are at most `most` of them between two values. */
export function ticks(low: number, high: number, most: number): number[] {
  const raw = (high - low) / Math.max(1, most);
  if (!(raw > 0) || !Number.isFinite(raw)) return [];
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= raw * (1 - 1e-9)) ?? 10 * power;
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, index) => (first + index) * step);
}

/** Digits after the point that tell ticks apart. */
export function digitsOf(marks: readonly number[]): number {
  const step = marks.length > 1 ? (marks[1] as number) - (marks[0] as number) : 1;
  return Math.min(9, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
}

/** The bounds of an axis of values: round numbers with some room around the values, never empty. */
export function bounds(low: number, high: number): [number, number] {
  if (!(low <= high)) return [-1, 1];
  const room = (high - low || Math.max(1, Math.abs(high) * 0.1)) * 0.06;
  const marks = ticks(low - room, high + room, 10);
  const step = marks.length > 1 ? (marks[1] as number) - (marks[0] as number) : 1;
  return [Math.floor((low - room) / step) * step, Math.ceil((high + room) / step) * step];
}
