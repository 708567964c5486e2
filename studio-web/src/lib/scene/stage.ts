import type { Model } from "../state/model";
import { aidsOf, rangesOf } from "./aids";
import type { Solid, Vector } from "./builder";
import { Pieces, type Piece } from "./pieces";
import { copyPose, POSE, Poses, shift, type Scene } from "./poses";
import { solidsOf } from "./solids";
import { Strand, type Drawn } from "./strand";
import { Trace } from "./trace";

/** What goes less far is not drawn at its target. */
const GONE_MM = 1;
/** So long the way of a tip is seen. */
const SEEN_NS = 10e9;
const WORKS = new Set(["vacuum", "gripper", "tool"]);

function tipsOf({ frames, bodies }: Scene): number[] {
  const places = frames.map((_, place) => place);
  const drawing = new Set(bodies.flatMap(({ name, draws }) => (draws ? [name] : [])));
  const working = places.filter(
    (place) => WORKS.has(frames[place]?.kind ?? "") || drawing.has(frames[place]?.name ?? ""),
  );
  if (working.length) return working;
  const carriers = new Set(frames.map(({ joints, on }) => (joints.length ? on : null)));
  return places.filter((place) => frames[place]?.kind === "axis" && !carriers.has(frames[place].name));
}

/** The least box about everything. [mm] */
export interface Extent {
  low: Vector;
  high: Vector;
}

/** Where all solids of a scene are at one moment. Nothing is allocated for a picture. */
export class Stage {
  /** Those of elements, then workpieces. */
  solids: readonly Solid[];
  readonly poses: Poses;
  readonly pieces: Pieces;
  /** Solids of elements; those from `aids` on are shown at will. */
  readonly fixed: number;
  readonly aids: number;
  /** Changes with the workpieces. */
  revision = 0;
  /** Poses of the middles of the solids. */
  places = new Float64Array();
  /** 0: a solid is not there. */
  isThere = new Uint8Array();
  /** 0: where a solid of an element is, is not known. It is drawn where it would be at 0. */
  isKnown = new Uint8Array();
  /** Changes with that. */
  knowledge = 0;
  /** Ends of the least upright box about each solid: x, y, z. */
  lows = new Float64Array();
  highs = new Float64Array();
  /** Of each solid, wherever it may be. */
  readonly extents: readonly Extent[];
  /** Frames of what works on workpieces, or of the outermost axes. */
  readonly tips: readonly number[];
  /** Lines, by the numbers of their solids. */
  readonly lines: ReadonlyMap<number, Drawn>;
  /** Whether tips are drawn where they were and where they are going, too. */
  showsTargets = false;
  /** The element whose travel is shown; null: all. */
  travelShown: string | null = "";
  /** Values of the signals of `poses` where motions will end; NaN: it stands, or that is not known. */
  readonly targets: Float64Array;
  private readonly aims: Poses;
  private readonly slides: Int32Array;
  private readonly shown: Int32Array;

  /** `hasAids`: with solids that are shown at will. */
  constructor(scene: Scene, model: Model, pieces: readonly Piece[] = [], hasAids = false) {
    const solids = solidsOf(scene, model);
    this.tips = tipsOf(scene);
    this.solids = hasAids ? [...solids, ...aidsOf(scene, model, solids, this.tips)] : solids;
    this.fixed = this.solids.length;
    this.aids = solids.length;
    const more = this.solids.flatMap(({ slide, shown, line }) =>
      [slide?.signal ?? [], shown ?? [], line?.signal ?? []].flat(),
    );
    this.poses = new Poses(scene, more);
    this.pieces = new Pieces(scene, this.poses);
    this.aims = new Poses(scene, more);
    this.targets = new Float64Array(this.poses.signals.length).fill(NaN);
    const place = (signal: string | undefined | null) => (signal ? this.poses.signals.indexOf(signal) : -1);
    this.slides = Int32Array.from(this.solids, ({ slide }) => place(slide?.signal));
    this.shown = Int32Array.from(this.solids, ({ shown }) => place(shown));
    this.lines = new Map(
      this.solids.flatMap((solid, n): [number, Trace | Strand][] =>
        solid.line === undefined ? [] : [[n, this.lineOf(solid, solid.line)]],
      ),
    );
    this.take(pieces);
    this.extents = this.widest(rangesOf(scene, model));
    this.poses.values.fill(NaN);
    this.update();
  }

  /** The workpieces from now on. */
  take(pieces: readonly Piece[]): void {
    this.pieces.take(pieces);
    this.solids = [...this.solids.slice(0, this.fixed), ...this.pieces.solids];
    const count = this.solids.length;
    this.places = new Float64Array(count * POSE);
    this.isThere = new Uint8Array(count);
    this.isKnown = new Uint8Array(count).fill(1);
    this.lows = new Float64Array(3 * count);
    this.highs = new Float64Array(3 * count);
    this.revision++;
  }

  private lineOf({ frame, at }: Solid, { signal, on, end }: NonNullable<Solid["line"]>): Trace | Strand {
    if (end !== null) return new Strand(this.poses, frame, at, on, end);
    return signal === null
      ? new Trace(this.poses, frame, on, -1, SEEN_NS)
      : new Trace(this.poses, frame, on, this.poses.signals.indexOf(signal));
  }

  /** Lines go up to where things are at a moment [ns], for which `poses` are up to date. */
  trace(now: number): void {
    for (const [n, line] of this.lines) {
      if (!(line instanceof Trace)) continue;
      if (n >= this.aids && !this.showsTargets) line.clear();
      else line.take(now);
    }
  }

  /** Everything from the values of `poses` and `pieces`. */
  update(): void {
    const { poses, places, aims, targets } = this;
    poses.update();
    if (this.showsTargets) {
      for (let k = 0; k < targets.length; k++) {
        const target = targets[k] as number;
        aims.values[k] = Number.isNaN(target) ? (poses.values[k] as number) : target;
      }
      aims.update();
    }
    for (let n = this.fixed; n < this.solids.length; n++) {
      this.pieces.place(n - this.fixed, places, n * POSE);
      this.isThere[n] = 1;
      this.bound(n);
    }
    for (let n = 0; n < this.fixed; n++) {
      const { isCarried, frame, at, slide, material, line } = this.solids[n] as Solid;
      const from = n * POSE;
      const isGhost = material === "ghost";
      if (n >= this.aids && !this.isAsked(n)) {
        this.isThere[n] = 0;
        continue;
      }
      if (line !== undefined) {
        this.placeLine(n, line.end === null ? line.on : -1);
        continue;
      }
      const of = isGhost ? aims : poses;
      copyPose(places, from, isCarried ? of.carried : of.bases, frame * POSE);
      shift(places, from, at[0], at[1], at[2]);
      if (slide !== null) {
        const value = poses.values[this.slides[n] as number] || 0;
        shift(places, from, slide.by[0] * value, slide.by[1] * value, slide.by[2] * value);
      }
      const known = poses.isKnown[2 * frame + Number(isCarried)] as number;
      if (this.isKnown[n] !== known) this.knowledge++;
      this.isKnown[n] = known;
      const shown = this.shown[n] as number;
      this.isThere[n] = shown < 0 || (poses.values[shown] as number) > 0 ? 1 : 0;
      this.bound(n);
    }
  }

  /** Whether somebody wants to see an aid that there is now. */
  private isAsked(n: number): boolean {
    const { element, frame, material } = this.solids[n] as Solid;
    if (material === "line") return this.showsTargets;
    if (material === "ghost") return this.showsTargets && this.isGoing(frame);
    const slides = this.slides[n] as number;
    const isKnown = slides < 0 || !Number.isNaN(this.poses.values[slides]);
    return isKnown && (this.travelShown === null || this.travelShown === element);
  }

  /** Whether a tip is not where it will be. */
  private isGoing(frame: number): boolean {
    let way = 0;
    for (let k = frame * POSE; k < (frame + 1) * POSE; k++)
      way = Math.max(way, Math.abs((this.aims.carried[k] as number) - (this.poses.carried[k] as number)));
    return way > GONE_MM;
  }

  private placeLine(n: number, on: number): void {
    const { places, poses, lows, highs } = this;
    const trace = this.lines.get(n) as Drawn;
    if (trace instanceof Strand) trace.update();
    const from = n * POSE;
    if (on < 0) copyPose(places, from, poses.floor, 0);
    else copyPose(places, from, poses.carried, on * POSE);
    this.isThere[n] = trace.count > 0 ? 1 : 0;
    for (let k = 0; k < 3; k++) {
      const row = from + 3 * k;
      let middle = places[from + 9 + k] as number;
      let half = 0;
      for (let j = 0; j < 3; j++) {
        const by = places[row + j] as number;
        middle += (by * ((trace.low[j] as number) + (trace.high[j] as number))) / 2;
        half += (Math.abs(by) * ((trace.high[j] as number) - (trace.low[j] as number))) / 2;
      }
      lows[3 * n + k] = middle - half;
      highs[3 * n + k] = middle + half;
    }
  }

  private bound(n: number): void {
    const { size } = this.solids[n] as Solid;
    for (let k = 0; k < 3; k++) {
      const row = n * POSE + 3 * k;
      let half = 0;
      for (let j = 0; j < 3; j++) half += (Math.abs(this.places[row + j] as number) * (size[j] as number)) / 2;
      const middle = this.places[n * POSE + 9 + k] as number;
      this.lows[3 * n + k] = middle - half;
      this.highs[3 * n + k] = middle + half;
    }
  }

  /** The least box about all of them. */
  get extent(): Extent {
    const ends = (choose: typeof Math.min, of: keyof Extent) =>
      [0, 1, 2].map((k) => choose(...this.extents.map((one) => one[of][k] as number))) as unknown as Vector;
    return { low: ends(Math.min, "low"), high: ends(Math.max, "high") };
  }

  private widest(ranges: ReadonlyMap<string, readonly [number, number]>): Extent[] {
    // Of what turns each eighth of a turn is seen.
    const STEPS = 8;
    const lows = new Float64Array(this.lows.length).fill(Infinity);
    const highs = new Float64Array(this.highs.length).fill(-Infinity);
    for (let step = 0; step <= STEPS; step++) {
      this.poses.signals.forEach((signal, k) => {
        const [from, to] = ranges.get(signal) ?? [0, 1];
        this.poses.values[k] = from + ((to - from) * step) / STEPS;
      });
      this.update();
      for (let k = 0; k < lows.length; k++) {
        if (!this.isThere[Math.floor(k / 3)]) continue;
        lows[k] = Math.min(lows[k] as number, this.lows[k] as number);
        highs[k] = Math.max(highs[k] as number, this.highs[k] as number);
      }
    }
    const part = (all: Float64Array, n: number) => Array.from(all.subarray(3 * n, 3 * n + 3)) as unknown as Vector;
    return this.solids
      .map((_, n) => ({ low: part(lows, n), high: part(highs, n) }))
      .filter(({ low, high }) => low[0] <= high[0]);
  }
}
