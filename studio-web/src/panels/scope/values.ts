import type { AxisState } from "../../lib/state/axis.svelte";
import type { Edges } from "../../lib/state/edges";
import type { Passed } from "../../lib/state/passed";
import { phaseCurrent } from "../../lib/state/waveforms";
import type { AxisModel } from "../../lib/state/model";
import { isCurve, isPassed, type CurrentSignal, type Signal } from "./signals";

/** Where values come from. */
export interface Sources {
  axis(model: AxisModel): AxisState;
  edges: Edges;
  passed: Passed;
}

/** The value of a signal at a moment; NaN where it is not known. */
export function valueAt(sources: Sources, signal: Signal, time_ns: bigint): number {
  if (isPassed(signal)) return signal.kind === "frames" ? NaN : sources.passed.at(signal.source, time_ns);
  if (signal.kind === "current") return currentAt(sources, signal, time_ns);
  if (!isCurve(signal)) return sources.edges.at(signal.pin, time_ns);
  const axis = sources.axis(signal.axis);
  const first = axis.intervals[0];
  if (first === undefined) return signal.kind === "position" ? sampleAt(axis.samples, time_ns) : NaN;
  return time_ns < first.from_ns ? NaN : axis.at(time_ns)[signal.kind];
}

/** Of the microstep that the motor is on. */
function currentAt(sources: Sources, { axis: model, pin, phase }: CurrentSignal, time_ns: bigint): number {
  const axis = sources.axis(model);
  const interval = axis.intervalAt(time_ns);
  if (interval === null || time_ns < interval.from_ns) return NaN;
  return phaseCurrent(sources.edges.at(pin, time_ns), phase, interval.trajectory.counted(time_ns));
}

function sampleAt(samples: readonly { time_ns: bigint; position: number }[], time_ns: bigint): number {
  let found = NaN;
  for (const sample of samples) {
    if (sample.time_ns > time_ns) break;
    found = sample.position;
  }
  return found;
}
