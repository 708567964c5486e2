import { POSE, type Poses } from "./poses";
import type { Drawn } from "./strand";

/** From one look to the next. [ns] */
export const STEP_NS = 40e6;
/** Nothing is known of what was drawn for so long. */
const LOST_NS = 1e9;
/** The oldest points are given up, a part of them at a time. */
export const MOST = 4096;
const GIVEN_UP = 512;
/** Points nearer to a straight line are not kept. [mm] */
const STRAIGHT_MM = 0.02;

/** What a body has drawn, or where a tip was, in the frame that the line goes on with: points x, y, z; before each further stroke is
 * one of NaN. */
export class Trace implements Drawn {
  readonly points = new Float32Array(3 * MOST);
  count = 0;
  /** Ends of the least box about it. */
  readonly low = new Float64Array(3);
  readonly high = new Float64Array(3);
  /** Changes with the points. */
  version = 0;
  private last = NaN;
  /** Points of this stroke. */
  private stroke = 0;
  /** How far those that were not kept since the last corner are beside the line, together: a curve is no straight line bit by bit. */
  private bent = 0;
  private readonly at = new Float64Array(3);
  /** When the points were drawn that are given up after a time. [ns] */
  private readonly times: number[] = [];

  /** `frame` draws, on another one (below 0: the floor), while a value is above 0 (below 0: always), and is seen for so long. */
  constructor(
    private readonly poses: Poses,
    private readonly frame: number,
    private readonly on: number,
    private readonly value: number,
    private readonly kept_ns = Infinity,
  ) {}

  /** Where time has gone back, or was not seen, it begins anew. */
  take(now: number): void {
    if (now < this.last || now - this.last > LOST_NS) this.clear();
    else if (now - this.last < STEP_NS) return;
    this.last = now;
    const draws = this.value < 0 || (this.poses.values[this.value] as number) > 0;
    if (!draws && this.stroke === 0) return;
    this.look();
    this.add();
    if (this.kept_ns < Infinity) this.giveUp(now);
    if (!draws) this.stroke = 0;
  }

  clear(): void {
    if (this.count > 0) this.version++;
    this.count = this.stroke = this.times.length = 0;
    this.last = NaN;
  }

  private giveUp(now: number): void {
    this.times.push(now);
    const old = this.times.findIndex((time) => now - time < this.kept_ns);
    this.times.splice(0, old);
    this.points.copyWithin(0, 3 * old, 3 * this.count);
    this.count -= old;
  }

  /** Where the body is, seen from what it draws on. */
  private look(): void {
    const { poses, at, frame, on } = this;
    const its = frame * POSE + 9;
    const from = on < 0 ? poses.floor : poses.carried;
    const base = on < 0 ? 0 : on * POSE;
    for (let k = 0; k < 3; k++) {
      let sum = 0;
      for (let row = 0; row < 3; row++) {
        const way = (poses.carried[its + row] as number) - (from[base + 9 + row] as number);
        sum += (from[base + 3 * row + k] as number) * way;
      }
      at[k] = sum;
    }
  }

  private add(): void {
    const { points, at } = this;
    if (this.count > MOST - 3) {
      points.copyWithin(0, 3 * GIVEN_UP, 3 * this.count);
      this.count -= GIVEN_UP;
    }
    if (this.stroke === 0 && this.count > 0) points[3 * this.count++] = NaN;
    if (this.stroke > 1 && this.kept_ns === Infinity && this.isStraight()) this.count--;
    else {
      this.stroke++;
      this.bent = 0;
    }
    for (let k = 0; k < 3; k++) {
      const place = at[k] as number;
      points[3 * this.count + k] = place;
      this.low[k] = this.count === 0 ? place : Math.min(this.low[k] as number, place);
      this.high[k] = this.count === 0 ? place : Math.max(this.high[k] as number, place);
    }
    this.count++;
    this.version++;
  }

  /** Whether the last point is on the way from the one before to the new one. */
  private isStraight(): boolean {
    const { points, at, count } = this;
    let [long, along, wide] = [0, 0, 0];
    for (let k = 0; k < 3; k++) {
      const before = points[3 * (count - 2) + k] as number;
      const way = (at[k] as number) - before;
      const past = (points[3 * (count - 1) + k] as number) - before;
      long += way * way;
      along += way * past;
      wide += past * past;
    }
    if (along < 0 || along > long) return false;
    this.bent += Math.sqrt(Math.max(0, wide - (long === 0 ? 0 : (along * along) / long)));
    return this.bent < STRAIGHT_MM;
  }
}
