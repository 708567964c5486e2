export type Speed = number | "max";

export interface Pace {
  running: boolean;
  /** Virtual seconds in a second; the one at which time goes on where it stands. */
  speed: Speed;
}

/** A difference to the server up to this is made up for gradually. [real seconds] */
const SLEW_WITHIN_S = 0.25;
/** How much faster or slower the clock goes meanwhile. */
const SLEW = 0.1;

/** The time of the world between the messages that tell it: it goes on evenly and never back while time goes. */
export class WorldClock {
  pace: Pace = { running: false, speed: 1 };
  private base_ns = 0n;
  private base_ms = 0;
  /** What has still to be made up for. [ns of virtual time] */
  private behind_ns = 0;
  private told_ns = 0n;
  private told_ms = 0;
  /** Measured where time goes as fast as it can. [virtual seconds in a second] */
  private measured = 1;

  /** The whole state has come: no gradual change. */
  reset(time_ns: bigint, pace: Pace, now_ms: number): void {
    this.pace = pace;
    this.base_ns = this.told_ns = time_ns;
    this.base_ms = this.told_ms = now_ms;
    this.behind_ns = 0;
  }

  /** What a message about the time has. */
  tell(time_ns: bigint, pace: Pace, now_ms: number): void {
    this.measure(time_ns, now_ms);
    const shown_ns = this.now(now_ms);
    const isSteady = pace.running && this.pace.running && pace.speed === this.pace.speed;
    const error_ns = Number(time_ns - shown_ns);
    if (!isSteady || Math.abs(error_ns) > SLEW_WITHIN_S * 1e9 * this.rateOf(pace)) {
      this.reset(time_ns, pace, now_ms);
      return;
    }
    this.base_ns = shown_ns;
    this.base_ms = now_ms;
    this.behind_ns = error_ns;
  }

  /** Something happened at `time_ns`: it is at least so late. */
  atLeast(time_ns: bigint, now_ms: number): void {
    if (time_ns > this.now(now_ms)) this.reset(time_ns, this.pace, now_ms);
  }

  now(now_ms: number): bigint {
    if (!this.pace.running) return this.base_ns;
    const gone_ns = (now_ms - this.base_ms) * 1e6 * this.rateOf(this.pace);
    const most = SLEW * gone_ns;
    return this.base_ns + BigInt(Math.round(gone_ns + Math.max(-most, Math.min(most, this.behind_ns))));
  }

  private rateOf(pace: Pace): number {
    return pace.speed === "max" ? this.measured : pace.speed;
  }

  private measure(time_ns: bigint, now_ms: number): void {
    const real_ms = now_ms - this.told_ms;
    if (real_ms < 20) return;
    if (this.pace.running) this.measured = Number(time_ns - this.told_ns) / 1e6 / real_ms;
    this.told_ns = time_ns;
    this.told_ms = now_ms;
  }
}
