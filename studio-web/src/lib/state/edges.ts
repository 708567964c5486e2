/** Levels of pins in the past: their edges, with the moments. Bounded; the oldest are forgotten first. */

interface PinEdges {
  times: bigint[];
  levels: number[];
}

/** Edges kept of one pin. */
const KEPT = 2000;

export class Edges {
  private readonly pins = new Map<string, PinEdges>();

  /** The level of a pin from `time_ns` on; null where it is not known. */
  take(pin: string, time_ns: bigint, level: number | null): void {
    let kept = this.pins.get(pin);
    if (kept === undefined) this.pins.set(pin, (kept = { times: [], levels: [] }));
    const value = level ?? NaN;
    if (Object.is(kept.levels.at(-1), value)) return;
    kept.times.push(time_ns);
    kept.levels.push(value);
    if (kept.times.length > KEPT) {
      kept.times.splice(0, KEPT / 10);
      kept.levels.splice(0, KEPT / 10);
    }
  }

  /** All edges between two moments in their order, and the levels at the first, instead of what is known of that time. */
  takeEarlier(
    edges: Iterable<readonly [pin: string, time_ns: bigint, level: number | null]>,
    from_ns: bigint,
    to_ns: bigint,
  ): void {
    const earlier = new Edges();
    for (const [pin, time_ns, level] of edges) earlier.take(pin, time_ns, level);
    for (const [pin, found] of earlier.pins) {
      const kept = this.pins.get(pin) ?? { times: [], levels: [] };
      const [first, last] = [this.before(kept, from_ns - 1n) + 1, this.before(kept, to_ns - 1n) + 1];
      const count = this.before(found, to_ns - 1n) + 1;
      const joined = <T>(old: T[], between: T[]): T[] =>
        [...old.slice(0, first), ...between.slice(0, count), ...old.slice(last)].slice(-KEPT);
      this.pins.set(pin, { times: joined(kept.times, found.times), levels: joined(kept.levels, found.levels) });
    }
  }

  /** What happens from a moment on is not known, until something is taken again. */
  lose(time_ns: bigint): void {
    for (const pin of this.pins.keys()) this.take(pin, time_ns, null);
  }

  /** Time has gone back to `time_ns`: what was later has not happened. */
  forgetAfter(time_ns: bigint): void {
    for (const kept of this.pins.values()) {
      kept.times.length = kept.levels.length = this.before(kept, time_ns) + 1;
    }
  }

  /** Of all edges, in no order. */
  *moments(): Iterable<bigint> {
    for (const { times } of this.pins.values()) yield* times;
  }

  /** NaN where it is not known. */
  at(pin: string, time_ns: bigint): number {
    const kept = this.pins.get(pin);
    return kept === undefined ? NaN : (kept.levels[this.before(kept, time_ns)] ?? NaN);
  }

  /** Calls with each interval of a level that has a part between two moments. */
  intervals(
    pin: string,
    from_ns: bigint,
    to_ns: bigint,
    draw: (from_ns: bigint, to_ns: bigint, level: number) => void,
  ): void {
    const kept = this.pins.get(pin);
    if (kept === undefined) return;
    for (let index = Math.max(0, this.before(kept, from_ns)); index < kept.times.length; index++) {
      const begin = kept.times[index] as bigint;
      if (begin >= to_ns) return;
      const end = kept.times[index + 1] ?? to_ns;
      draw(begin < from_ns ? from_ns : begin, end > to_ns ? to_ns : end, kept.levels[index] as number);
    }
  }

  /** The index of the last edge at or before a moment; −1 without. */
  private before(kept: PinEdges, time_ns: bigint): number {
    let [low, high] = [0, kept.times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((kept.times[middle] as bigint) <= time_ns) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }
}
