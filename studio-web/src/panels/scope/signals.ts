import type { AxisModel, Model } from "../../lib/state/model";
import type { Quantity } from "./columns";

interface Common {
  /** `table.M1.position`, `table.IN3`. */
  id: string;
  label: string;
  unit: string;
}

export interface CurveSignal extends Common {
  kind: Quantity;
  axis: AxisModel;
}

/** A pin: a lane of levels, or a curve in volts. */
export interface PinSignal extends Common {
  kind: "level" | "voltage";
  pin: string;
}

export type Signal = CurveSignal | PinSignal;

export const isCurve = (signal: Signal): signal is CurveSignal =>
  signal.kind === "position" || signal.kind === "velocity";

/** All that can be shown, in the order of the model. */
export function signalsOf(model: Model, words: (quantity: Quantity) => string): Signal[] {
  const several = model.machines.length > 1;
  return model.machines.flatMap((machine): Signal[] => {
    const curves = machine.axes.flatMap((axis): Signal[] =>
      (["position", "velocity"] as const).map((kind) => ({
        id: `${axis.id}.${kind}`,
        label: `${axis.label} ${words(kind)}`,
        unit: kind === "position" ? axis.unit : `${axis.unit}/s`,
        kind,
        axis,
      })),
    );
    const pins = machine.sheet.pins.map((pin): Signal => {
      const label = several ? `${machine.name} ${pin.name}` : pin.name;
      const common = { id: `${machine.name}.${pin.name}`, label, unit: pin.unit, pin: `${machine.name}.${pin.name}` };
      return { ...common, kind: pin.unit === "V" ? "voltage" : "level" };
    });
    return [...curves, ...pins];
  });
}

/** Shown at first: positions of the axes that drive something, or of the first four. */
export function usual(signals: readonly Signal[]): string[] {
  const positions = signals.filter((signal): signal is CurveSignal => signal.kind === "position");
  const driving = positions.filter(({ axis }) => axis.mechanics);
  return (driving.length ? driving : positions).slice(0, 4).map(({ id }) => id);
}

/** What shares an axis of values: curves of one unit. */
export function tracksOf(signals: readonly Signal[]): { unit: string; signals: Signal[] }[] {
  const tracks = new Map<string, Signal[]>();
  for (const signal of signals) {
    if (signal.kind === "level") continue;
    const kept = tracks.get(signal.unit);
    if (kept === undefined) tracks.set(signal.unit, [signal]);
    else kept.push(signal);
  }
  return [...tracks].map(([unit, members]) => ({ unit, signals: members }));
}
