/** The moment nearest to `time_ns` before (-1) or after (1) it; null without one. */
export function nearest(moments: Iterable<bigint>, time_ns: bigint, direction: -1 | 1): bigint | null {
  let found: bigint | null = null;
  for (const moment of moments) {
    if (direction < 0 ? moment >= time_ns : moment <= time_ns) continue;
    if (found === null || (direction < 0 ? moment > found : moment < found)) found = moment;
  }
  return found;
}
