import { dot, plus, times, type Vector } from "./builder";
import { PLACE } from "./poses";
import type { Extent, Stage } from "./stage";

/** A parallel view: where right, up, and towards who looks are in space. */
export interface View {
  right: Vector;
  up: Vector;
  near: Vector;
}

/** Seen from an angle about the upright [degrees], 0 is from the front, and from so far above. */
function viewFrom(around: number, above: number): View {
  const [a, b] = [(around * Math.PI) / 180, (above * Math.PI) / 180];
  const [ca, sa, cb, sb] = [Math.cos(a), Math.sin(a), Math.cos(b), Math.sin(b)];
  return { right: [ca, sa, 0], up: [-sa * sb, ca * sb, cb], near: [sa * cb, -ca * cb, sb] };
}

export const VIEWS = {
  oblique: viewFrom(-24, 24),
  front: { right: [1, 0, 0], up: [0, 0, 1], near: [0, -1, 0] },
  side: { right: [0, 1, 0], up: [0, 0, 1], near: [1, 0, 0] },
  top: { right: [1, 0, 0], up: [0, 1, 0], near: [0, 0, 1] },
} as const satisfies Record<string, View>;
export type ViewName = keyof typeof VIEWS;

/** Left, upper edge, width and height of a picture of them, y downwards. */
export function frameOf({ right, up }: View, extents: readonly Extent[]): [number, number, number, number] {
  const span = (direction: Vector): [number, number] => {
    const ends = extents.flatMap(({ low, high }) => {
      const middle = dot(direction, times(plus(low, high), 0.5));
      const half = dot(direction.map(Math.abs) as unknown as Vector, times(plus(high, times(low, -1)), 0.5));
      return [middle - half, middle + half];
    });
    return [Math.min(...ends), Math.max(...ends)];
  };
  const [left, right_end] = span(right);
  const [bottom, top] = span(up);
  return [left, -top, right_end - left, top - bottom];
}

/** As a share of the longer side. */
const ROOM = 0.06;

/** As `frameOf`, with room around what is in it. */
export function pageOf(view: View, extents: readonly Extent[]): [number, number, number, number] {
  const [left, top, wide, tall] = frameOf(view, extents);
  const room = ROOM * Math.max(wide, tall);
  return [left - room, top - room, wide + 2 * room, tall + 2 * room];
}

/** What is looked at, and from how far away, so that all is in a picture of central perspective. `slopes`: of its edges, to the right
 * and upwards. */
export function standOf({ right, up, near }: View, extents: readonly Extent[], slopes: readonly [number, number]) {
  const corners = extents.flatMap(({ low, high }) =>
    Array.from({ length: 8 }, (_, n): Vector => [
      n & 1 ? high[0] : low[0],
      n & 2 ? high[1] : low[1],
      n & 4 ? high[2] : low[2],
    ]),
  );
  const along = [right, up, near].map((direction) => corners.map((corner) => dot(direction, corner)));
  const [x = 0, y = 0, z = 0] = along.map((places) => (Math.min(...places) + Math.max(...places)) / 2);
  const far = corners.map((_, n) => {
    const [a = 0, b = 0, c = 0] = along.map((places) => places[n] as number);
    return c - z + (1 + 2 * ROOM) * Math.max(Math.abs(a - x) / slopes[0], Math.abs(b - y) / slopes[1]);
  });
  return { middle: plus(times(right, x), times(up, y), times(near, z)), far: Math.max(...far) };
}

/** Of a direction that is nearly in the picture. */
const FLAT = 0.01;
const TOUCHING_MM = 0.01;

/** In what order solids are drawn, those behind first, and aids above all. */
export class Order {
  drawn = new Int32Array();
  private state = new Uint8Array();
  /** Ends of each along right and up, in the picture. */
  private spans = new Float64Array();
  private count = 0;

  constructor(
    private readonly stage: Stage,
    private readonly view: View,
  ) {}

  update(): void {
    const count = this.stage.solids.length;
    if (this.drawn.length !== count) {
      this.drawn = new Int32Array(count);
      this.state = new Uint8Array(count);
      this.spans = new Float64Array(4 * count);
    }
    this.state.fill(0);
    this.count = 0;
    for (let n = 0; n < count; n++) {
      this.span(n, this.view.right, 4 * n);
      this.span(n, this.view.up, 4 * n + 2);
    }
    const { aids, fixed } = this.stage;
    this.state.fill(1, aids, fixed);
    for (let n = 0; n < count; n++) this.visit(n);
    for (let n = aids; n < fixed; n++) this.drawn[this.count++] = n;
  }

  /** After all that is behind it. */
  private visit(n: number): void {
    if (this.state[n]) return;
    this.state[n] = 1;
    for (let other = 0; other < this.drawn.length; other++)
      if (!this.state[other] && this.meets(n, other) && this.isBehind(other, n)) this.visit(other);
    this.drawn[this.count++] = n;
  }

  /** Whether two cover each other in the picture, or might. */
  private meets(one: number, other: number): boolean {
    const { spans } = this;
    const a = 4 * one;
    const b = 4 * other;
    return (
      (spans[a] as number) < (spans[b + 1] as number) &&
      (spans[b] as number) < (spans[a + 1] as number) &&
      (spans[a + 2] as number) < (spans[b + 3] as number) &&
      (spans[b + 2] as number) < (spans[a + 3] as number)
    );
  }

  private span(n: number, direction: Vector, to: number): void {
    const { lows, highs } = this.stage;
    let middle = 0;
    let half = 0;
    for (let k = 0; k < 3; k++) {
      const low = lows[3 * n + k] as number;
      const high = highs[3 * n + k] as number;
      middle += ((low + high) / 2) * (direction[k] as number);
      half += ((high - low) / 2) * Math.abs(direction[k] as number);
    }
    this.spans[to] = middle - half;
    this.spans[to + 1] = middle + half;
  }

  /** Where a plane between two has one of them on the side of who looks, that one is covered by nothing of the other. Where they
   * overlap, the plane is across the axis along which they do least. */
  private isBehind(one: number, other: number): boolean {
    const { lows, highs } = this.stage;
    let isFree = false;
    let isOtherFree = false;
    let least = Infinity;
    let isLower = one < other;
    for (let k = 0; k < 3; k++) {
      const towards = this.view.near[k] as number;
      if (Math.abs(towards) < FLAT) continue;
      const low = lows[3 * one + k] as number;
      const high = highs[3 * one + k] as number;
      const from = lows[3 * other + k] as number;
      const to = highs[3 * other + k] as number;
      isFree ||= towards > 0 ? low >= to - TOUCHING_MM : high <= from + TOUCHING_MM;
      isOtherFree ||= towards > 0 ? high <= from + TOUCHING_MM : low >= to - TOUCHING_MM;
      const apart = (low + high - from - to) * towards;
      const overlap = (Math.min(high, to) - Math.max(low, from)) / Math.min(high - low, to - from);
      if (overlap >= least || apart === 0) continue;
      least = overlap;
      isLower = apart < 0;
    }
    // Where both are free, neither covers the other, and an order would only make circles.
    return isOtherFree ? !isFree : !isFree && isLower;
  }
}

/** How far the place of a pose is along a direction. */
export function placeAlong(direction: Vector, numbers: Float64Array, pose: number): number {
  const at = pose + PLACE;
  return direction[0] * (numbers[at] as number) + direction[1] * (numbers[at + 1] as number) + direction[2] * (numbers[at + 2] as number); // prettier-ignore
}
