import type { FaultKind } from "../../lib/state/faults.svelte";
import type { Model } from "../../lib/state/model";

export const PRESETS = ["worn", "noAir", "looseCable"] as const;
export type Preset = (typeof PRESETS)[number];

/** Inputs of controllers that a contact of an axis or of an element drives. */
function contacts({ mechanics, elements }: Model): readonly string[] {
  const drawn = elements.flatMap(({ drawing }) => drawing?.switches ?? []);
  return [...new Set([...mechanics.flatMap(({ switches }) => switches), ...drawn].map(({ pin }) => pin))];
}

const bounce = (pin: string, bounces: number, for_ms: number): string => {
  const [machine, name] = pin.split(".", 2);
  return `bounce machine=${machine} pin=${name} bounces=${bounces} for_ms=${for_ms}`;
};

/** What can be chosen for a preset that is about one thing; empty for those about the whole machine. */
export function targetsOf(preset: Preset, model: Model): readonly string[] {
  if (preset !== "looseCable") return [];
  const isPin = (name: string) => model.controllers.some((one) => name.startsWith(`${one.name}.`));
  const wired = model.connections.map(({ target }) => target).filter(isPin);
  return [...model.lines.map(({ name }) => name), ...new Set(wired)];
}

/** The faults of a preset, as texts; none where it does not fit the machine. */
export function faultsOf(preset: Preset, model: Model, kinds: readonly FaultKind[], target = ""): readonly string[] {
  const elements = (kind: string) => {
    const takes = kinds.find(({ name }) => name === kind)?.elements ?? [];
    return model.elements.filter((one) => takes.includes(one.kind)).map(({ name }) => `${kind} element=${name}`);
  };
  switch (preset) {
    case "worn":
      return [
        ...contacts(model)
          .filter((pin) => model.controllers.some(({ name }) => pin.startsWith(`${name}.`)))
          .map((pin) => bounce(pin, 5, 8)),
        ...model.mechanics.map(
          ({ controller, axis }) => `lost-steps machine=${controller} axis=${axis} at_s=5 period_s=20`,
        ),
        ...elements("worn-jaws"),
      ];
    case "noAir":
      return [...elements("no-air"), ...elements("leak")];
    case "looseCable":
      if (model.lines.some(({ name }) => name === target))
        return ["drop", "flip"].map((kind) => `${kind} line=${target} probability=0.02`);
      return target ? [bounce(target, 9, 300)] : [];
  }
}
