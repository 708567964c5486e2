import type { Fields, RequestName } from "../protocol/connection";
import type { Requests, ValuesMessage } from "../protocol/types";

export type Ask = <N extends RequestName>(
  name: N,
  fields: Fields<N>,
  within_ms?: number,
) => Promise<Requests[N]["answer"]>;

/** A value that is watched: undefined until it has come, null where it is not known. */
export class Watched {
  value = $state<number | null | undefined>(undefined);
}

/** Points that something on the page shows. Whoever shows them asks for them, and lets them go. */
export class Watch {
  readonly points: readonly string[];
  readonly rate: number;
  private readonly values: ReadonlyMap<string, Watched>;

  constructor(points: readonly string[], rate: number) {
    this.points = [...new Set(points)];
    this.rate = rate;
    this.values = new Map(this.points.map((point) => [point, new Watched()]));
  }

  /** Undefined until it has come, and for what is not watched here. */
  get(point: string | null): number | null | undefined {
    return point === null ? undefined : this.values.get(point)?.value;
  }

  take(changes: readonly [number, number | null][]): void {
    for (const [index, value] of changes) {
      const point = this.points[index];
      const watched = point === undefined ? undefined : this.values.get(point);
      if (watched !== undefined) watched.value = value;
    }
  }
}

/** All watches of the page, kept across reconnections. */
export class Watches {
  private readonly open = new Map<Watch, number | null>();
  private readonly byNumber = new Map<string, Watch>();
  /** Values that came before the answer that names their watch had been dealt with: both may be in one batch. */
  private readonly early = new Map<string, [number, number | null][]>();
  private asked = 0;

  constructor(private readonly ask: Ask) {}

  /** The points, and what ends it. */
  add(points: readonly string[], rate = 10): [Watch, () => void] {
    const watch = new Watch(points, rate);
    this.open.set(watch, null);
    if (watch.points.length) this.begin(watch);
    return [watch, () => this.end(watch)];
  }

  /** A new connection knows of no watches. */
  renew(): void {
    this.byNumber.clear();
    for (const watch of this.open.keys()) if (watch.points.length) this.begin(watch);
  }

  take(values: ValuesMessage["values"]): void {
    for (const [number, changes] of Object.entries(values)) {
      const watch = this.byNumber.get(number);
      if (watch !== undefined) watch.take(changes);
      else if (this.asked > 0) this.early.set(number, [...(this.early.get(number) ?? []), ...changes]);
    }
  }

  private begin(watch: Watch): void {
    this.asked++;
    this.ask("watch", { points: [...watch.points], rate: watch.rate })
      .then(({ watch: number }) => this.begun(watch, number))
      .catch(() => undefined)
      .finally(() => {
        if (--this.asked === 0) this.early.clear();
      });
  }

  private begun(watch: Watch, number: number): void {
    if (!this.open.has(watch)) {
      this.forget(number);
      return;
    }
    this.open.set(watch, number);
    this.byNumber.set(String(number), watch);
    watch.take(this.early.get(String(number)) ?? []);
  }

  private end(watch: Watch): void {
    const number = this.open.get(watch);
    this.open.delete(watch);
    if (number === null || number === undefined) return;
    this.byNumber.delete(String(number));
    this.forget(number);
  }

  private forget(number: number): void {
    this.ask("unwatch", { watch: number }).catch(() => undefined);
  }
}
