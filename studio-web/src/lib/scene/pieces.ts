import type { Hello } from "../protocol/connection";
import { PLAIN, type Solid } from "./builder";
import { copyPose, directionOf, POSE, shift, turn, type Poses, type Scene } from "./poses";
import { partsOf } from "./shapes";

export type Piece = Hello["workpieces"][number];

/** Those of the palette that no axis and no mark has. */
const COLORS = [2, 3, 4, 5, 7, 8] as const;

/** What pieces look like that come from one element: on every page alike. */
function lookOf({ name }: Piece, { origins }: Scene): { shape: string | null; color: string } {
  const place = origins.findIndex((origin) => origin.name === name.slice(0, name.lastIndexOf(".")));
  const { shape = null, color = null } = origins[place] ?? {};
  return { shape, color: color ?? `--trace-${COLORS[Math.max(0, place) % COLORS.length]}` };
}

/** Workpieces on what carries them. Only `take` allocates. */
export class Pieces {
  solids: readonly Solid[] = [];
  /** Of the workpieces that the solids belong to. */
  names: readonly string[] = [];
  /** Their numbers. */
  private of: readonly number[] = [];
  /** Ways of belts, by whose changes since pieces were put there they move on; not those that move frames, too. */
  signals: readonly string[] = [];
  /** Of these; NaN where they are not known. */
  values = new Float64Array();
  /** Number of the first move of each, and behind the last one. */
  private moves = new Int32Array();
  /** Signal of each move, then those of the poses. */
  private ways = new Int32Array();
  private from = new Float64Array();
  /** Along x, y and z for a unit of the signal. */
  private by = new Float64Array();
  private at = new Float64Array();
  private yaws = new Float64Array();

  constructor(
    private readonly scene: Scene,
    private readonly poses: Poses,
  ) {}

  /** Signals by which pieces move on and that move no frame. */
  waysOf(pieces: readonly Piece[]): readonly string[] {
    const names = pieces.flatMap(({ moves }) => moves.map(({ signal }) => signal));
    return [...new Set(names)].filter((signal) => !this.poses.signals.includes(signal));
  }

  take(pieces: readonly Piece[]): void {
    const { frames } = this.scene;
    const known = new Map(this.signals.map((signal, k) => [signal, this.values[k] as number]));
    this.signals = this.waysOf(pieces);
    this.values = Float64Array.from(this.signals, (signal) => known.get(signal) ?? NaN);
    const parts = pieces.flatMap((piece, n) => {
      const { shape, color } = lookOf(piece, this.scene);
      const frame = frames.findIndex(({ name }) => name === piece.on);
      return partsOf({ ...piece, shape }).map((part): [number, Solid] => [
        n,
        { ...PLAIN, ...part, element: piece.on ?? "", frame, isCarried: true, material: "piece", color: part.color ?? color }, // prettier-ignore
      ]);
    });
    this.of = parts.map(([n]) => n);
    this.solids = parts.map(([, solid]) => solid);
    this.names = this.of.map((n) => pieces[n]?.name ?? "");
    const moves = pieces.flatMap((piece) => piece.moves);
    const all = [...this.signals, ...this.poses.signals];
    this.moves = new Int32Array(pieces.length + 1);
    pieces.forEach((piece, n) => (this.moves[n + 1] = (this.moves[n] as number) + piece.moves.length));
    this.ways = Int32Array.from(moves, ({ signal }) => all.indexOf(signal));
    this.from = Float64Array.from(moves, ({ at }) => at);
    this.by = Float64Array.from(
      moves.flatMap(({ along, per_unit }) => {
        const [axis, sign] = directionOf(along);
        return [0, 1, 2].map((k) => (k === axis ? sign * per_unit : 0));
      }),
    );
    this.at = Float64Array.from(
      pieces.flatMap(({ at, height }) => [at[0] ?? 0, at[1] ?? 0, (at[2] ?? 0) + height / 2]),
    );
    this.yaws = Float64Array.from(pieces, ({ yaw }) => yaw);
  }

  /** The pose of the middle of a solid. */
  place(solid: number, to: Float64Array, at: number): void {
    const { frame, at: beside } = this.solids[solid] as Solid;
    const n = this.of[solid] as number;
    const { at: its, by, poses } = this;
    if (frame < 0) copyPose(to, at, poses.floor, 0);
    else copyPose(to, at, poses.carried, frame * POSE);
    shift(to, at, its[3 * n] as number, its[3 * n + 1] as number, its[3 * n + 2] as number);
    for (let k = this.moves[n] as number; k < (this.moves[n + 1] as number); k++) {
      const way = this.ways[k] as number;
      const count = this.values.length;
      const value = way < count ? (this.values[way] as number) : (poses.values[way - count] as number);
      const moved = value - (this.from[k] as number) || 0;
      shift(
        to,
        at,
        moved * (by[3 * k] as number),
        moved * (by[3 * k + 1] as number),
        moved * (by[3 * k + 2] as number),
      );
    }
    const yaw = this.yaws[n] as number;
    if (yaw !== 0) turn(to, at, 2, yaw);
    shift(to, at, beside[0], beside[1], beside[2]);
  }
}
