import type { Hello } from "../protocol/connection";
import { shapeOf, type Solid } from "./builder";
import { copyPose, directionOf, POSE, shift, turn, type Poses, type Scene } from "./poses";

export type Piece = Hello["workpieces"][number];

/** Those of the palette that no axis and no mark has. */
const COLORS = [2, 3, 4, 5, 7, 8] as const;

/** All pieces from one element have one color, the same on every page. */
function colorOf({ name }: Piece, { frames }: Scene): string {
  const origins = frames.filter(({ kind }) => kind === "conveyor" || kind === "nest");
  const place = origins.findIndex((origin) => origin.name === name.slice(0, name.lastIndexOf(".")));
  return `--trace-${COLORS[Math.max(0, place) % COLORS.length]}`;
}

/** Workpieces on what carries them. Only `take` allocates. */
export class Pieces {
  solids: readonly Solid[] = [];
  names: readonly string[] = [];
  /** Ways of belts, by whose changes since pieces were put there they move on. */
  signals: readonly string[] = [];
  /** Of these; NaN where they are not known. */
  values = new Float64Array();
  /** What moves each on, of the signals; below 0: nothing. */
  private ways = new Int32Array();
  private from = new Float64Array();
  private at = new Float64Array();
  private along = new Float64Array();
  private yaws = new Float64Array();

  constructor(private readonly scene: Scene) {}

  take(pieces: readonly Piece[]): void {
    const { frames } = this.scene;
    const known = new Map(this.signals.map((signal, k) => [signal, this.values[k] as number]));
    this.signals = [...new Set(pieces.flatMap(({ travel }) => travel ?? []))];
    this.values = Float64Array.from(this.signals, (signal) => known.get(signal) ?? NaN);
    this.names = pieces.map(({ name }) => name);
    this.solids = pieces.map((piece): Solid => ({
      ...{ element: piece.on ?? "", frame: frames.findIndex(({ name }) => name === piece.on), isCarried: true },
      ...{ at: [0, 0, 0], slide: null, shown: null, pin: null, material: "piece" },
      ...shapeOf(piece),
      color: colorOf(piece, this.scene),
    }));
    this.ways = Int32Array.from(pieces, ({ travel }) => (travel === null ? -1 : this.signals.indexOf(travel)));
    this.from = Float64Array.from(pieces, ({ travel_at }) => travel_at);
    this.at = Float64Array.from(
      pieces.flatMap(({ at, height }) => [at[0] ?? 0, at[1] ?? 0, (at[2] ?? 0) + height / 2]),
    );
    this.yaws = Float64Array.from(pieces, ({ yaw }) => yaw);
    this.along = Float64Array.from(
      this.solids.flatMap(({ frame }) => {
        const [axis, sign] = directionOf(frames[frame]?.along ?? "+x");
        return [0, 1, 2].map((k) => (k === axis ? sign : 0));
      }),
    );
  }

  /** The pose of the middle of one. */
  place(n: number, poses: Poses, to: Float64Array, at: number): void {
    const { frame } = this.solids[n] as Solid;
    if (frame < 0) copyPose(to, at, poses.floor, 0);
    else copyPose(to, at, poses.carried, frame * POSE);
    const way = this.ways[n] as number;
    const moved = way < 0 ? 0 : (this.values[way] as number) - (this.from[n] as number) || 0;
    const { at: its, along } = this;
    shift(
      to,
      at,
      (its[3 * n] as number) + moved * (along[3 * n] as number),
      (its[3 * n + 1] as number) + moved * (along[3 * n + 1] as number),
      (its[3 * n + 2] as number) + moved * (along[3 * n + 2] as number),
    );
    const yaw = this.yaws[n] as number;
    if (yaw !== 0) turn(to, at, 2, yaw);
  }
}
