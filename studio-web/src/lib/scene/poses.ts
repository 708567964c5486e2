import type { Description } from "../protocol/types";

export type Scene = Description["scene"];

/** Numbers of a pose: a turn as a matrix of 3 × 3, row by row, then a place [mm]. */
export const POSE = 12;
/** Number of the first one of its place. */
export const PLACE = 9;
const AXES = "xyz";
const SIGNS: Readonly<Record<string, number>> = { "+": 1, "-": -1 };

/** The axis and sign of a direction such as `-z`. */
export function directionOf(along: string): [axis: number, sign: number] {
  return [Math.max(0, AXES.indexOf(along.slice(1))), SIGNS[along.charAt(0)] ?? 1];
}

interface Joint {
  /** Of its position, in `values`. */
  value: number;
  axis: number;
  /** mm or degrees for a unit of its signal. */
  per_unit: number;
  turns: boolean;
}

/** The turn about an axis, after that of a pose. Quarter turns are exact. */
export function turn(poses: Float64Array, from: number, axis: number, degrees: number): void {
  const reduced = degrees % 360;
  const quarter = reduced % 90 === 0 ? (reduced / 90 + 4) % 4 : -1;
  const angle = (reduced * Math.PI) / 180;
  const c = quarter < 0 ? Math.cos(angle) : quarter % 2 ? 0 : 1 - quarter;
  const s = quarter < 0 ? Math.sin(angle) : quarter % 2 ? 2 - quarter : 0;
  const a = (axis + 1) % 3;
  const b = (axis + 2) % 3;
  for (let row = from; row < from + PLACE; row += 3) {
    const u = poses[row + a] as number;
    const v = poses[row + b] as number;
    poses[row + a] = c * u + s * v;
    poses[row + b] = c * v - s * u;
  }
}

/** The place of a pose moves by a distance in its own directions. */
export function shift(poses: Float64Array, from: number, dx: number, dy: number, dz: number): void {
  for (let k = 0; k < 3; k++) {
    const row = from + 3 * k;
    const moved = (poses[row] as number) * dx + (poses[row + 1] as number) * dy + (poses[row + 2] as number) * dz;
    poses[from + PLACE + k] = (poses[from + PLACE + k] as number) + moved;
  }
}

export function copyPose(to: Float64Array, at: number, poses: Float64Array, from: number): void {
  for (let k = 0; k < POSE; k++) to[at + k] = poses[from + k] as number;
}

/** Where frames are, from the values of signals at one moment. As `steptwin.simulation.space.frames.pose` has them, for the eye. */
export class Poses {
  /** What moves frames, and what the page draws besides. */
  readonly signals: readonly string[];
  /** Of the signals; NaN, which is not known, is 0 for a joint. */
  readonly values: Float64Array;
  /** Of each frame where it stands, in the order of the scene. */
  readonly bases: Float64Array;
  /** Of what is on it. */
  readonly carried: Float64Array;
  /** Whether these are known: of each frame where it stands, then what is on it. */
  readonly isKnown: Uint8Array;
  private readonly order: Int32Array;
  private readonly carriers: Int32Array;
  private readonly origins: Float64Array;
  private readonly joints: readonly (readonly Joint[])[];
  readonly floor = Float64Array.of(1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0);

  constructor({ frames }: Scene, more: readonly string[] = []) {
    const places = new Map(frames.map(({ name }, place) => [name, place]));
    this.signals = [...new Set([...frames.flatMap(({ joints }) => joints.map(({ signal }) => signal)), ...more])];
    this.values = new Float64Array(this.signals.length).fill(NaN);
    this.bases = new Float64Array(frames.length * POSE);
    this.carried = new Float64Array(frames.length * POSE);
    this.isKnown = new Uint8Array(2 * frames.length);
    this.carriers = Int32Array.from(frames, ({ on }) => (on === null ? -1 : (places.get(on) ?? -1)));
    this.origins = Float64Array.from(frames.flatMap(({ at }) => at));
    this.joints = frames.map(({ joints }) =>
      joints.map(({ signal, along, turns, per_unit }) => {
        const [axis, sign] = directionOf(along);
        return { value: this.signals.indexOf(signal), axis, per_unit: sign * per_unit, turns };
      }),
    );
    this.order = Int32Array.from(this.outwards());
  }

  /** Carriers before what they carry. */
  private outwards(): Iterable<number> {
    const found = new Set<number>();
    const add = (frame: number) => {
      if (frame < 0 || found.has(frame)) return;
      add(this.carriers[frame] as number);
      found.add(frame);
    };
    this.carriers.forEach((_, frame) => add(frame));
    return found;
  }

  /** The poses from `values`. */
  update(): void {
    for (let n = 0; n < this.order.length; n++) {
      const frame = this.order[n] as number;
      const from = frame * POSE;
      const carrier = this.carriers[frame] as number;
      if (carrier < 0) copyPose(this.bases, from, this.floor, 0);
      else copyPose(this.bases, from, this.carried, carrier * POSE);
      const at = 3 * frame;
      const { origins } = this;
      shift(this.bases, from, origins[at] as number, origins[at + 1] as number, origins[at + 2] as number);
      copyPose(this.carried, from, this.bases, from);
      const known = carrier < 0 ? 1 : (this.isKnown[2 * carrier + 1] as number);
      this.isKnown[2 * frame] = this.isKnown[2 * frame + 1] = known;
      const joints = this.joints[frame] as readonly Joint[];
      for (let k = 0; k < joints.length; k++) {
        const { value, axis, per_unit, turns } = joints[k] as Joint;
        const position = (this.values[value] as number) * per_unit || 0;
        if (Number.isNaN(this.values[value])) this.isKnown[2 * frame + 1] = 0;
        if (turns) turn(this.carried, from, axis, position);
        else shift(this.carried, from, axis === 0 ? position : 0, axis === 1 ? position : 0, axis === 2 ? position : 0);
      }
    }
  }
}
