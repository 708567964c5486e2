/** What has passed, by its source: moments with a number each. Bounded; the oldest are forgotten first. */

/** Kept of one source. */
const KEPT = 20_000;

interface Kept {
  times: bigint[];
  numbers: number[];
}

export class Passed {
  private readonly sources = new Map<string, Kept>();

  take(source: string, time_ns: bigint, number: number): void {
    let kept = this.sources.get(source);
    if (kept === undefined) this.sources.set(source, (kept = { times: [], numbers: [] }));
    kept.times.push(time_ns);
    kept.numbers.push(number);
    if (kept.times.length > KEPT) {
      kept.times.splice(0, KEPT / 10);
      kept.numbers.splice(0, KEPT / 10);
    }
  }

  /** What passed between a moment and the next one that was taken is not known. */
  lose(time_ns: bigint): void {
    for (const kept of this.sources.values()) {
      const index = this.before(kept, time_ns) + 1;
      kept.times.splice(index, 0, time_ns);
      kept.numbers.splice(index, 0, NaN);
    }
  }

  /** Time has gone back to `time_ns`: what was later has not happened. */
  forgetAfter(time_ns: bigint): void {
    for (const kept of this.sources.values()) kept.times.length = kept.numbers.length = this.before(kept, time_ns) + 1;
  }

  /** The number that came last; NaN before the first one. */
  at(source: string, time_ns: bigint): number {
    const kept = this.sources.get(source);
    return kept === undefined ? NaN : (kept.numbers[this.before(kept, time_ns)] ?? NaN);
  }

  /** From the last one before `from_ns` on, each with the moment of the next one. */
  *between(
    source: string,
    from_ns: bigint,
    to_ns: bigint,
  ): Iterable<{ from_ns: bigint; to_ns: bigint; number: number }> {
    const kept = this.sources.get(source);
    if (kept === undefined) return;
    for (let index = Math.max(0, this.before(kept, from_ns)); index < kept.times.length; index++) {
      const begin = kept.times[index] as bigint;
      if (begin >= to_ns) return;
      const number = kept.numbers[index] as number;
      if (!Number.isNaN(number)) yield { from_ns: begin, to_ns: kept.times[index + 1] ?? to_ns, number };
    }
  }

  /** The index of the last one at or before a moment; −1 without. */
  private before({ times }: Kept, time_ns: bigint): number {
    let [low, high] = [0, times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((times[middle] as bigint) <= time_ns) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }
}
