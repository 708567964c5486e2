import type { Vector } from "./builder";
import { copyPose, POSE, shift, type Poses } from "./poses";

/** A line in the frame that it goes on with: points x, y, z; before each further stroke is one of NaN. */
export interface Drawn {
  readonly points: Float32Array<ArrayBuffer>;
  readonly count: number;
  /** Ends of the least box about it. */
  readonly low: Float64Array;
  readonly high: Float64Array;
  /** Changes with the points. */
  readonly version: number;
}

/** A straight line between two elements, such as a wire or a rope, on the floor. */
export class Strand implements Drawn {
  readonly points = new Float32Array(6);
  readonly count = 2;
  readonly low = new Float64Array(3);
  readonly high = new Float64Array(3);
  version = 0;
  private readonly pose = new Float64Array(POSE);

  /** Places in the frames of what is on its elements. */
  constructor(
    private readonly poses: Poses,
    private readonly frame: number,
    private readonly at: Vector,
    private readonly other: number,
    private readonly end: Vector,
  ) {}

  update(): void {
    let has = this.put(0, this.frame, this.at);
    has = this.put(3, this.other, this.end) || has;
    if (!has) return;
    this.version++;
    for (let k = 0; k < 3; k++) {
      this.low[k] = Math.min(this.points[k] as number, this.points[3 + k] as number);
      this.high[k] = Math.max(this.points[k] as number, this.points[3 + k] as number);
    }
  }

  /** Gives whether it is elsewhere than before. */
  private put(from: number, frame: number, at: Vector): boolean {
    copyPose(this.pose, 0, this.poses.carried, frame * POSE);
    shift(this.pose, 0, at[0], at[1], at[2]);
    let has = false;
    for (let k = 0; k < 3; k++) {
      const place = Math.fround(this.pose[9 + k] as number);
      if (this.points[from + k] === place) continue;
      this.points[from + k] = place;
      has = true;
    }
    return has;
  }
}
