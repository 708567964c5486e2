import { dot, plus, times, type Vector } from "../../lib/scene/builder";
import type { View } from "../../lib/scene/view";

/** Steps of the grid, the finest that is so far apart on the screen. */
const STEPS_MM = [1, 5, 10];
const APART_PX = 5;
/** Of what is moved without a grid. */
const FREE_MM = 0.1;
/** A way in the picture that is none. */
const STILL_MM = 1e-6;
const KEYS: Readonly<Record<string, readonly [right: number, up: number]>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

/** `scale`: pixels for 1 mm. */
export function stepOf(scale: number, isFree: boolean): number {
  if (isFree) return FREE_MM;
  return STEPS_MM.find((step) => step * scale >= APART_PX) ?? 10;
}

/** The way of so much to the right and upwards in a picture. */
export function wayIn({ right, up }: View, rightwards: number, upwards: number): Vector {
  return plus(times(right, rightwards), times(up, upwards));
}

/** The way of a key in a picture; null: it is no arrow. */
export function wayOfKey(view: View, key: string, step: number): Vector | null {
  const found = KEYS[key];
  return found === undefined ? null : wayIn(view, found[0] * step, found[1] * step);
}

const row = (pose: Float64Array, from: number): Vector => [pose[from] ?? 0, pose[from + 1] ?? 0, pose[from + 2] ?? 0];

/** A way in space, seen from what has a pose. */
export function seenFrom(pose: Float64Array, way: Vector): Vector {
  const [x, y, z] = [row(pose, 0), row(pose, 3), row(pose, 6)];
  return plus(times(x, way[0]), times(y, way[1]), times(z, way[2]));
}

/** A way on what has a pose, seen from space. */
export function fromThere(pose: Float64Array, way: Vector): Vector {
  return [dot(row(pose, 0), way), dot(row(pose, 3), way), dot(row(pose, 6), way)];
}

/** A place after a way; on the grid along where it goes. */
export function onGrid(at: Vector, way: Vector, step: number): Vector {
  const moved = at.map((from, k) => {
    const by = way[k] as number;
    return Math.abs(by) < STILL_MM ? from : Math.round(Math.round((from + by) / step) * step * 1e4) / 1e4;
  });
  return moved as unknown as Vector;
}
