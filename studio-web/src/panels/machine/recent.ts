/** Where two axes are at a moment. */
export interface Spot {
  at_ns: bigint;
  x: number;
  y: number;
}

/** Where two axes have been, by their plans. A moment is computed once, and again when plans have changed. */
export class Recent {
  private spots: Spot[] = [];
  private version = "";

  /** `step_ns`: between two moments. */
  constructor(private readonly step_ns: bigint) {}

  /** The moments from `from_ns` on, before `now_ns`. `version` is another one when earlier spots no longer hold. */
  between(from_ns: bigint, now_ns: bigint, version: string, spot: (at_ns: bigint) => Spot): readonly Spot[] {
    const begin_ns = ((from_ns + this.step_ns - 1n) / this.step_ns) * this.step_ns;
    if (version !== this.version || (this.spots[0]?.at_ns ?? now_ns) > begin_ns) this.spots = [];
    this.version = version;
    this.spots = this.spots.filter(({ at_ns }) => at_ns >= begin_ns && at_ns < now_ns);
    const last = this.spots.at(-1);
    let at_ns = last === undefined ? begin_ns : last.at_ns + this.step_ns;
    for (; at_ns < now_ns; at_ns += this.step_ns) this.spots.push(spot(at_ns));
    return this.spots;
  }
}
