import { directionOf, type Scene } from "./poses";

export type Vector = readonly [x: number, y: number, z: number];

/** What a solid is made of; how that looks is said by who draws it. */
export type Material =
  "frame" | "rail" | "drive" | "moving" | "rod" | "belt" | "piece" | "mark" | "lamp" | "light" | "glass" | "line" | Aid;
/** Shown besides the machine, at will: where something will be, how far an axis goes, and where what works may be. */
export type Aid = "ghost" | "travel" | "workspace";

/** A box or a prism that an element is drawn with: it stands on its frame, or is carried by it. */
export interface Solid {
  element: string;
  /** Of the scene. */
  frame: number;
  isCarried: boolean;
  /** Its middle, in that frame, and its extent along x, y and z. [mm] */
  at: Vector;
  size: Vector;
  /** Of a prism: the axis it is upright on, its corners, the direction of the first of them, and how wide its lower and its upper
   * end are, as shares. Null: a box. */
  prism: { axis: number; corners: number; towards: Vector; ends: readonly [number, number] } | null;
  material: Material;
  /** #RRGGBB, or a property of app.css such as `--trace-2`. */
  color: string | null;
  /** A signal by which it moves besides, and how far for a unit. */
  slide: { signal: string; by: Vector } | null;
  /** A signal: it is there while that is above 0. */
  shown: string | null;
  /** It is lit while this is on. */
  pin: string | null;
  /** Instead of a solid: the line that its place leaves on a frame (below 0: the floor) while a signal is above 0 (null: always,
   * and only the last seconds of it); or the one to its end on that frame. */
  line?: { signal: string | null; on: number; end: Vector | null };
}

/** Another text for each shape. */
export const shapeOf = ({ size, prism }: Solid): string => JSON.stringify([size, prism]);

/** A solid that stands, and always looks as its material does. */
export const PLAIN = { prism: null, color: null, slide: null, shown: null, pin: null, isCarried: false } as const;

type Frame = Scene["frames"][number];
type Look = Partial<Omit<Solid, "frame" | "at" | "size">>;

/** Corners of what is round. */
export const ROUND = 32;
const EVEN = [1, 1] as const;
export const unit = (axis: number, length: number): Vector => [+(axis === 0) * length, +(axis === 1) * length, +(axis === 2) * length]; // prettier-ignore
export const plus = (...vectors: readonly Vector[]): Vector =>
  vectors.reduce((one, other) => [one[0] + other[0], one[1] + other[1], one[2] + other[2]]);
export const dot = (one: Vector, other: Vector): number => one[0] * other[0] + one[1] * other[1] + one[2] * other[2];
export const times = (vector: Vector, by: number): Vector => [vector[0] * by, vector[1] * by, vector[2] * by];
export const between = (low: number, value: number, high: number) => Math.min(high, Math.max(low, value));

/** The solids of one frame, in directions of what it moves: along it, across it, and upwards or in the third direction. */
export class Builder {
  readonly axis: number;
  readonly sign: number;
  readonly along: Vector;
  readonly across: Vector;
  readonly up: Vector;

  constructor(
    readonly frame: Frame,
    readonly place: number,
    readonly put: (solid: Solid) => void,
    along = frame.joints[0]?.along ?? frame.along ?? "+x",
  ) {
    [this.axis, this.sign] = directionOf(along);
    this.along = unit(this.axis, this.sign);
    // Across is to the left of where it goes; of what is upright it is to the right of who stands before it.
    this.across = this.axis === 0 ? [0, this.sign, 0] : this.axis === 1 ? [-this.sign, 0, 0] : [1, 0, 0];
    this.up = this.axis === 2 ? [0, -1, 0] : [0, 0, 1];
  }

  /** Lengths along, across and up; `at` likewise. */
  box(at: Vector, size: Vector, material: Material, look: Look = {}): void {
    this.add(this.vector(at), this.vector(size).map(Math.abs) as unknown as Vector, material, look);
  }

  /** A cylinder about `axis`: 0 along, 1 across, 2 up. */
  rod(at: Vector, axis: number, length: number, diameter: number, material: Material, look: Look = {}): void {
    const size = [0, 1, 2].map((k) => (k === axis ? length : diameter)) as unknown as Vector;
    const about = this.vector(unit(axis, 1)).findIndex((one) => one !== 0);
    const towards: Vector = about === 0 ? [0, 1, 0] : [1, 0, 0];
    this.box(at, size, material, { prism: { axis: about, corners: ROUND, towards, ends: EVEN }, ...look });
  }

  /** An arrow that lies, and shows along. */
  arrow(at: Vector, size: number, look: Look): void {
    const about = this.vector([0, 0, 1]).findIndex((one) => one !== 0);
    this.box(at, [size, size, 1], "lamp", {
      prism: { axis: about, corners: 3, towards: this.along, ends: EVEN },
      ...look,
    });
  }

  vector([along, across, up]: Vector): Vector {
    return plus(times(this.along, along), times(this.across, across), times(this.up, up));
  }

  /** In the directions of the frame. */
  add(at: Vector, size: Vector, material: Material, look: Look = {}): void {
    this.put({ ...PLAIN, element: this.frame.name, frame: this.place, at, size, material, ...look });
  }
}
