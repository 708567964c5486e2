import type { Piece } from "../lib/scene/pieces";
import type { Description } from "../lib/protocol/types";

export type Machine = Pick<Description, "name" | "scene" | "elements" | "axes">;

/** From `at` on, where it is; null: it is not there. */
type Stint = readonly [at: number, place: Piece | null];

/** A machine in a run, as `steptwin.files.scene.recordedscene` writes it. Moments are ns from the begin of the run. */
export interface Recorded {
  machine: Machine;
  /** Of signals: five numbers for each span, its begin and the coefficients of a polynomial of the seconds since then. */
  motions: Readonly<Record<string, readonly number[]>>;
  /** Of pins and terminals: moment and level. */
  levels: Readonly<Record<string, readonly number[]>>;
  workpieces: readonly (readonly Stint[])[];
}

/** The last entry of `size` numbers that does not begin after a moment; below 0: none. */
export function lastAt(flat: readonly number[], size: number, at: number): number {
  let low = 0;
  let high = flat.length / size;
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((flat[middle * size] as number) <= at) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

const SPAN = 5;

export function valueAt(spans: readonly number[], at: number): number {
  const n = lastAt(spans, SPAN, at) * SPAN;
  if (n < 0) return NaN;
  const [begin, c0, c1, c2, c3] = spans.slice(n, n + SPAN) as [number, number, number, number, number];
  const s = (at - begin) / 1e9;
  return c0 + s * (c1 + s * (c2 + s * c3));
}

export function levelAt(changes: readonly number[], at: number): number | null {
  const n = lastAt(changes, 2, at);
  return n < 0 ? null : (changes[2 * n + 1] as number);
}

/** The workpieces of a run at moments: the same list as long as none comes, goes or is carried by something else. */
export class Workpieces {
  private readonly moments: readonly number[];
  private shown = NaN;
  private list: readonly Piece[] = [];

  constructor(private readonly all: Recorded["workpieces"]) {
    this.moments = [...new Set(all.flatMap((one) => one.map(([at]) => at)))].sort((a, b) => a - b);
  }

  at(moment: number): readonly Piece[] {
    const change = this.moments[lastAt(this.moments, 1, moment)] ?? -1;
    if (change === this.shown) return this.list;
    this.shown = change;
    this.list = this.all.flatMap((stints) => stints.filter(([at]) => at <= change).at(-1)?.[1] ?? []);
    return this.list;
  }
}
