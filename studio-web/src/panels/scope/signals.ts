import type { AxisModel, ControllerModel, Model } from "../../lib/state/model";
import type { Quantity } from "./columns";

interface Common {
  /** `table.M1.position`, `table.IN3`. */
  id: string;
  label: string;
  unit: string;
  /** null: of a line. */
  controller: ControllerModel | null;
}

export interface CurveSignal extends Common {
  kind: Quantity;
  axis: AxisModel;
}

/** A pin: a channel of levels, or a curve in volts. */
export interface PinSignal extends Common {
  kind: "level" | "voltage";
  pin: string;
}

/** The current of a phase of a motor, in % of its greatest value; `pin` has the number of its waveform. */
export interface CurrentSignal extends Common {
  kind: "current";
  axis: AxisModel;
  pin: string;
  phase: 1 | 2;
}

/** A channel of what passes: the frames of a line, the lines of a program that a controller executes. */
export interface PassedSignal extends Common {
  kind: "frames" | "statements";
  source: string;
}

export type Signal = CurveSignal | CurrentSignal | PinSignal | PassedSignal;

export const isCurve = (signal: Signal): signal is CurveSignal =>
  signal.kind === "position" || signal.kind === "velocity";

export const isPassed = (signal: Signal): signal is PassedSignal =>
  signal.kind === "frames" || signal.kind === "statements";

/** Of a height of its own; all others share axes of values. */
export const isChannel = (signal: Signal): boolean => signal.kind === "level" || isPassed(signal);

/** The pin of a chip that tells the waveform of its phase currents. */
const WAVEFORM = "N";
type Words = Quantity | "current" | "frames" | "statements";

const passed = (kind: PassedSignal["kind"], source: string): Omit<PassedSignal, "label" | "controller"> => ({
  id: `${source}.${kind}`,
  unit: "",
  kind,
  source,
});

/** All that can be shown, in the order of the model. */
export function signalsOf(model: Model, words: (what: Words) => string): Signal[] {
  const several = model.controllers.length > 1;
  const ofControllers = model.controllers.flatMap((controller): Signal[] => {
    const curves = controller.axes.flatMap((axis): Signal[] =>
      (["position", "velocity"] as const).map((kind) => ({
        id: `${axis.id}.${kind}`,
        label: `${axis.label} ${words(kind)}`,
        unit: kind === "position" ? axis.unit : `${axis.unit}/s`,
        controller,
        kind,
        axis,
      })),
    );
    const pin = `${controller.name}.${WAVEFORM}`;
    const drives = controller.sheet.pins.some(({ name }) => name === WAVEFORM) ? controller.axes : [];
    const currents = drives.flatMap((axis): Signal[] =>
      ([1, 2] as const).map((phase) => ({
        id: `${axis.id}.current${phase}`,
        label: `${axis.label} ${words("current")} ${phase}`,
        unit: "%",
        controller,
        kind: "current",
        axis,
        pin,
        phase,
      })),
    );
    const statements: Signal[] = controller.isReal
      ? []
      : [{ ...passed("statements", controller.name), controller, label: `${controller.name} ${words("statements")}` }];
    const pins = controller.sheet.pins.map((pin): Signal => {
      const label = several ? `${controller.name} ${pin.name}` : pin.name;
      const common = {
        id: `${controller.name}.${pin.name}`,
        label,
        unit: pin.unit,
        controller,
        pin: `${controller.name}.${pin.name}`,
      };
      return { ...common, kind: pin.unit === "V" ? "voltage" : "level" };
    });
    return [...curves, ...currents, ...pins, ...statements];
  });
  const frames = model.lines.map(({ name }): Signal => ({
    ...passed("frames", name),
    controller: null,
    label: `${name} ${words("frames")}`,
  }));
  return [...ofControllers, ...frames];
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
    if (isChannel(signal)) continue;
    const kept = tracks.get(signal.unit);
    if (kept === undefined) tracks.set(signal.unit, [signal]);
    else kept.push(signal);
  }
  return [...tracks].map(([unit, members]) => ({ unit, signals: members }));
}
