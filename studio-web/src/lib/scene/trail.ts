import { POSE } from "./poses";
import type { Stage } from "./stage";

/** Kept of each tip, and from one to the next. [ns of virtual time] */
const KEPT_NS = 10_000_000_000n;
const STEP_NS = 40_000_000n;
/** Nothing is known of what it did for so long. */
const LOST_NS = 1_000_000_000n;
export const MOST = Number(KEPT_NS / STEP_NS);

/** Where a tip was, as far as pictures were drawn of it, oldest first: x, y, z. */
export class Trail {
  readonly places = new Float32Array(3 * MOST);
  count = 0;
  private readonly times: bigint[] = [];

  constructor(
    private readonly stage: Stage,
    private readonly tip: number,
  ) {}

  /** Gives whether there is another point. Where time has gone back or was not seen it begins anew. */
  take(now_ns: bigint): boolean {
    const { times, places } = this;
    const last = times.at(-1);
    if (last !== undefined && now_ns >= last && now_ns - last < STEP_NS) return false;
    if (last !== undefined && (now_ns < last || now_ns - last > LOST_NS)) times.length = 0;
    const gone = times.findIndex((time_ns) => now_ns - time_ns < KEPT_NS);
    const dropped = Math.max(gone < 0 ? times.length : gone, times.length + 1 - MOST);
    times.splice(0, dropped);
    const kept = times.length;
    places.copyWithin(0, 3 * (this.count - kept), 3 * this.count);
    const from = this.tip * POSE + 9;
    for (let k = 0; k < 3; k++) places[3 * kept + k] = this.stage.poses.carried[from + k] as number;
    this.count = times.push(now_ns);
    return true;
  }
}
