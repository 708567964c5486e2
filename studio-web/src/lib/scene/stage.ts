import type { Model } from "../state/model";
import type { Solid, Vector } from "./builder";
import { Pieces, type Piece } from "./pieces";
import { copyPose, POSE, Poses, shift, type Scene } from "./poses";
import { solidsOf, travelOf } from "./solids";

const GHOST = { material: "ghost", color: null, pin: null, shown: null } as const;
/** What goes less far is not drawn at its target. */
const GONE_MM = 1;
const WORKS = new Set(["vacuum", "gripper", "tool"]);

function tipsOf({ frames }: Scene): number[] {
  const places = frames.map((_, place) => place);
  const working = places.filter((place) => WORKS.has(frames[place]?.kind ?? ""));
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
  /** Solids of elements. */
  readonly fixed: number;
  /** Changes with the workpieces. */
  revision = 0;
  /** Poses of the middles of the solids. */
  places = new Float64Array();
  /** 0: a solid is not there. */
  isThere = new Uint8Array();
  /** Ends of the least upright box about each solid: x, y, z. */
  lows = new Float64Array();
  highs = new Float64Array();
  /** Of all, wherever they may be. */
  readonly extent: Extent;
  /** Frames of what works on workpieces, or of the outermost axes. */
  readonly tips: readonly number[];
  /** Whether tips are drawn where they are going, too. */
  showsTargets = false;
  /** Values of the signals of `poses` where motions will end; NaN: it stands, or that is not known. */
  readonly targets: Float64Array;
  private readonly aims: Poses;
  private readonly slides: Int32Array;
  private readonly shown: Int32Array;

  /** `hasTargets`: solids for what is drawn where it is going. */
  constructor(scene: Scene, model: Model, pieces: readonly Piece[] = [], hasTargets = false) {
    const solids = solidsOf(scene, model);
    this.tips = tipsOf(scene);
    const isTip = ({ frame, isCarried }: Solid) =>
      hasTargets && this.tips.includes(frame) && (isCarried || scene.frames[frame]?.joints.length === 0);
    this.solids = [...solids, ...solids.filter(isTip).map((one): Solid => ({ ...one, ...GHOST }))];
    this.fixed = this.solids.length;
    this.pieces = new Pieces(scene);
    const more = this.solids.flatMap(({ slide, shown }) => [slide?.signal ?? [], shown ?? []].flat());
    this.poses = new Poses(scene, more);
    this.aims = new Poses(scene, more);
    this.targets = new Float64Array(this.poses.signals.length).fill(NaN);
    const place = (signal: string | undefined | null) => (signal ? this.poses.signals.indexOf(signal) : -1);
    this.slides = Int32Array.from(this.solids, ({ slide }) => place(slide?.signal));
    this.shown = Int32Array.from(this.solids, ({ shown }) => place(shown));
    this.take(pieces);
    this.extent = this.widest(rangesOf(scene, model));
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
    this.lows = new Float64Array(3 * count);
    this.highs = new Float64Array(3 * count);
    this.revision++;
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
      this.pieces.place(n - this.fixed, poses, places, n * POSE);
      this.isThere[n] = 1;
      this.bound(n);
    }
    for (let n = 0; n < this.fixed; n++) {
      const { isCarried, frame, at, slide, material } = this.solids[n] as Solid;
      const from = n * POSE;
      const isGhost = material === "ghost";
      if (isGhost && !(this.showsTargets && this.isGoing(frame))) {
        this.isThere[n] = 0;
        continue;
      }
      const of = isGhost ? aims : poses;
      copyPose(places, from, isCarried ? of.carried : of.bases, frame * POSE);
      shift(places, from, at[0], at[1], at[2]);
      if (slide !== null) {
        const value = poses.values[this.slides[n] as number] || 0;
        shift(places, from, slide.by[0] * value, slide.by[1] * value, slide.by[2] * value);
      }
      const shown = this.shown[n] as number;
      this.isThere[n] = shown < 0 || (poses.values[shown] as number) > 0 ? 1 : 0;
      this.bound(n);
    }
  }

  /** Whether a tip is not where it will be. */
  private isGoing(frame: number): boolean {
    let way = 0;
    for (let k = frame * POSE; k < (frame + 1) * POSE; k++)
      way = Math.max(way, Math.abs((this.aims.carried[k] as number) - (this.poses.carried[k] as number)));
    return way > GONE_MM;
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

  private widest(ranges: ReadonlyMap<string, readonly [number, number]>): Extent {
    const STEPS = 4;
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (let step = 0; step <= STEPS; step++) {
      this.poses.signals.forEach((signal, k) => {
        const [from, to] = ranges.get(signal) ?? [0, 1];
        this.poses.values[k] = from + ((to - from) * step) / STEPS;
      });
      this.update();
      for (let k = 0; k < this.lows.length; k++) {
        low[k % 3] = Math.min(low[k % 3] as number, this.lows[k] as number);
        high[k % 3] = Math.max(high[k % 3] as number, this.highs[k] as number);
      }
    }
    return { low: low as unknown as Vector, high: high as unknown as Vector };
  }
}

/** Where signals of motion may be, in their units. */
function rangesOf({ frames }: Scene, model: Model): Map<string, readonly [number, number]> {
  const found = new Map<string, readonly [number, number]>();
  for (const { joints } of frames)
    for (const { signal, turns, per_unit } of joints) if (turns) found.set(signal, [0, 360 / per_unit]);
  for (const axis of model.mechanics) {
    const joint = frames.find(({ name }) => name === axis.name)?.joints[0];
    if (joint !== undefined && !joint.turns) found.set(joint.signal, travelOf(axis, joint.per_unit));
  }
  for (const { name, drawing } of model.elements) {
    if (drawing === null || drawing.shape === "dial") continue;
    const { low, length, across_low, across } = drawing;
    drawing.places.forEach((place, k) =>
      found.set(
        `${name}.${place}`,
        drawing.shape === "plane" && k === 1 ? [across_low, across_low + across] : [low, low + length],
      ),
    );
  }
  return found;
}
