import type { Model } from "../state/model";
import { copyPose, directionOf, FLOOR, POSE, Poses, shift, turn, type Scene } from "./poses";
import { pieceOf, solidsOf, travelOf, type Piece, type Solid, type Vector } from "./solids";

/** The least box about everything. [mm] */
export interface Extent {
  low: Vector;
  high: Vector;
}

/** Where all solids of a scene are at one moment. Nothing is allocated for a picture. */
export class Stage {
  readonly solids: readonly Solid[];
  readonly poses: Poses;
  /** Poses of the middles of the solids. */
  readonly places: Float64Array;
  /** 0: a solid is not there. */
  readonly isThere: Uint8Array;
  /** Ends of the least upright box about each solid: x, y, z. */
  readonly lows: Float64Array;
  readonly highs: Float64Array;
  /** Of all, wherever they may be. */
  readonly extent: Extent;
  /** Places in `solids` for workpieces, from here on. */
  private readonly first: number;
  private readonly keys: readonly string[];
  /** Of the workpiece that is drawn there. */
  private readonly pieces: (Piece | null)[];
  /** Where nothing takes workpieces in space, belts have places of fronts only. */
  private areListed = false;
  private readonly frames: Int32Array;
  private readonly travels: Int32Array;
  private readonly slides: Int32Array;
  private readonly shown: Int32Array;

  /** With room for twice as many workpieces. */
  constructor(
    private readonly scene: Scene,
    model: Model,
    pieces: readonly Piece[] = [],
  ) {
    const own = solidsOf(scene, model);
    const room = [...pieces, ...pieces].sort((one, other) => keyOf(one).localeCompare(keyOf(other)));
    this.first = own.length;
    this.keys = room.map(keyOf);
    this.pieces = room.map(() => null);
    this.frames = new Int32Array(room.length);
    this.travels = new Int32Array(room.length);
    this.areListed = pieces.length > 0;
    this.solids = [...own, ...room.map(pieceOf)];
    const belts = scene.frames.filter(({ kind }) => kind === "conveyor").map(({ name }) => `${name}.travel`);
    const more = this.solids.flatMap(({ slide, shown }) => [slide?.signal ?? [], shown ?? []].flat());
    this.poses = new Poses(scene, [...more, ...belts]);
    const place = (signal: string | undefined | null) => (signal ? this.poses.signals.indexOf(signal) : -1);
    const count = this.solids.length;
    this.places = new Float64Array(count * POSE);
    this.isThere = new Uint8Array(count);
    this.lows = new Float64Array(3 * count);
    this.highs = new Float64Array(3 * count);
    this.slides = Int32Array.from(this.solids, ({ slide }) => place(slide?.signal));
    this.shown = Int32Array.from(this.solids, ({ shown }) => place(shown));
    this.extent = this.widest(rangesOf(scene, model));
    this.poses.values.fill(NaN);
    this.update();
  }

  /** Where workpieces are from now on. Whether there is room for all of them. */
  take(pieces: readonly Piece[]): boolean {
    this.areListed ||= pieces.length > 0;
    this.pieces.fill(null);
    return pieces.every((piece) => {
      const key = keyOf(piece);
      const place = this.keys.findIndex((one, n) => one === key && this.pieces[n] === null);
      if (place < 0) return false;
      this.pieces[place] = piece;
      this.frames[place] = this.scene.frames.findIndex(({ name }) => name === piece.on);
      this.travels[place] = this.poses.signals.indexOf(piece.travel ?? "");
      return true;
    });
  }

  private updatePiece(n: number): void {
    const piece = this.pieces[n] ?? null;
    const at = this.first + n;
    this.isThere[at] = piece === null ? 0 : 1;
    if (piece === null) return;
    const { places, poses } = this;
    const [from, frame] = [at * POSE, this.frames[n] as number];
    if (frame < 0) copyPose(places, from, FLOOR, 0);
    else copyPose(places, from, poses.carried, frame * POSE);
    shift(places, from, piece.at[0] as number, piece.at[1] as number, piece.at[2] as number);
    // A belt goes on by what its signal has grown.
    const travel = (poses.values[this.travels[n] as number] as number) - piece.travel_at || 0;
    const [axis, sign] = directionOf(this.scene.frames[frame]?.along ?? "+x");
    shift(places, from, axis === 0 ? sign * travel : 0, axis === 1 ? sign * travel : 0, axis === 2 ? sign * travel : 0);
    turn(places, from, 2, piece.yaw);
    shift(places, from, 0, 0, piece.height / 2);
    this.bound(at);
  }

  /** Everything from the values of `poses`. */
  update(): void {
    const { poses, places } = this;
    poses.update();
    for (let n = 0; n < this.pieces.length; n++) this.updatePiece(n);
    for (let n = 0; n < this.first; n++) {
      const { isCarried, frame, at, slide } = this.solids[n] as Solid;
      const from = n * POSE;
      copyPose(places, from, isCarried ? poses.carried : poses.bases, frame * POSE);
      shift(places, from, at[0], at[1], at[2]);
      if (slide !== null) {
        const value = poses.values[this.slides[n] as number] || 0;
        shift(places, from, slide.by[0] * value, slide.by[1] * value, slide.by[2] * value);
      }
      const shown = this.shown[n] as number;
      const value = shown < 0 ? 1 : (poses.values[shown] as number);
      this.isThere[n] = (slide === null || shown < 0 ? value > 0 : !this.areListed && !Number.isNaN(value)) ? 1 : 0;
      this.bound(n);
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
      for (let k = 0; k < 3 * this.first; k++) {
        low[k % 3] = Math.min(low[k % 3] as number, this.lows[k] as number);
        high[k % 3] = Math.max(high[k % 3] as number, this.highs[k] as number);
      }
    }
    return { low: low as unknown as Vector, high: high as unknown as Vector };
  }
}

/** Equal for workpieces of one size. */
const keyOf = ({ size, diameter, height }: Piece) => `${size?.join(" ")} ${diameter} ${height}`;

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
