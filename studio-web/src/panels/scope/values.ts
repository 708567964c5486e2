import type { Studio } from "../../lib/state/studio.svelte";
import { isCurve, type Signal } from "./signals";

/** The value of a signal at a moment; NaN where it is not known. */
export function valueAt(studio: Studio, signal: Signal, time_ns: bigint): number {
  if (!isCurve(signal)) return studio.edges.at(signal.pin, time_ns);
  const axis = studio.axis(signal.axis);
  const first = axis.stretches[0];
  if (first === undefined) return signal.kind === "position" ? sampleAt(axis.samples, time_ns) : NaN;
  return time_ns < first.from_ns ? NaN : axis.at(time_ns)[signal.kind];
}

function sampleAt(samples: readonly { time_ns: bigint; position: number }[], time_ns: bigint): number {
  let found = NaN;
  for (const sample of samples) {
    if (sample.time_ns > time_ns) break;
    found = sample.position;
  }
  return found;
}
