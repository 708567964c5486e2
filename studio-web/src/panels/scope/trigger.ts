/** Looks for the moment at which a signal crosses a level. */

export type Slope = "rising" | "falling";

export interface Trigger {
  /** Of the signal; empty while there is none. */
  signal: string;
  slope: Slope;
  level: number;
}

/** A crossing is placed to this. [ns] */
const PRECISION_NS = 1000n;

/** Steps in which an interval of time is looked through: of 1 ms, and no more than 2000. */
export const stepOf = (gone_ns: bigint): bigint => (gone_ns > 2_000_000_000n ? gone_ns / 2000n : 1_000_000n);

/**
 * The first crossing after `from_ns` up to `to_ns`, looked for in steps of `step_ns`; null without one. Where the value is not known there is
 * none.
 */
export function crossing(
  value: (time_ns: bigint) => number,
  { slope, level }: Pick<Trigger, "slope" | "level">,
  from_ns: bigint,
  to_ns: bigint,
  step_ns: bigint,
): bigint | null {
  const isBeyond = (time_ns: bigint): boolean | null => {
    const found = value(time_ns);
    if (Number.isNaN(found)) return null;
    return slope === "rising" ? found >= level : found <= level;
  };
  let before = from_ns;
  let wasBeyond = isBeyond(from_ns);
  while (before < to_ns) {
    const next = before + step_ns < to_ns ? before + step_ns : to_ns;
    const beyond = isBeyond(next);
    if (wasBeyond === false && beyond === true) return bisect(isBeyond, before, next);
    [before, wasBeyond] = [next, beyond];
  }
  return null;
}

function bisect(isBeyond: (time_ns: bigint) => boolean | null, low_ns: bigint, high_ns: bigint): bigint {
  let [low, high] = [low_ns, high_ns];
  while (high - low > PRECISION_NS) {
    const middle = (low + high) / 2n;
    if (isBeyond(middle) === true) high = middle;
    else low = middle;
  }
  return high;
}
