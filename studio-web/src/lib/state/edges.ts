/** Levels of pins in the past: their edges, with the moments. Bounded; the oldest are forgotten first. */

interface PinEdges {
  times: bigint[];
  levels: number[];
}

/** Edges kept of one pin. */
const KEPT = 5000;

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

  /** What was before, in its order. */
  takeEarlier(edges: Iterable<readonly [pin: string, time_ns: bigint, level: number | null]>): void {
    const earlier = new Edges();
    for (const [pin, time_ns, level] of edges) earlier.take(pin, time_ns, level);
    for (const [pin, { times, levels }] of earlier.pins) {
      const kept = this.pins.get(pin);
      const first = kept?.times[0];
      const count = first === undefined ? times.length : times.filter((time_ns) => time_ns < first).length;
      const from = Math.max(0, count + (kept?.times.length ?? 0) - KEPT);
      this.pins.set(pin, {
        times: [...times.slice(from, count), ...(kept?.times ?? [])],
        levels: [...levels.slice(from, count), ...(kept?.levels ?? [])],
      });
    }
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
