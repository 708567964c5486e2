import type { FaultKind, FaultParameter } from "../../lib/state/faults.svelte";
import type { Model } from "../../lib/state/model";

/** Whether a fault of a kind has anything in the machine that it can happen to. */
export function canHappen({ layer, elements, lines }: FaultKind, model: Model): boolean {
  if (layer === "element") return model.elements.some(({ kind }) => elements.includes(kind));
  if (layer === "physics") return model.controllers.some(({ isReal }) => !isReal);
  // `lines` are protocols, such as Modbus RTU on a line of kind modbus.
  return model.lines.some(({ kind }) => !lines.length || lines.some((one) => one.toLowerCase().startsWith(kind)));
}

/** What a parameter can be, of what there is in the machine; none where it is a number or a text. */
export function choicesOf(
  parameter: FaultParameter,
  kind: FaultKind,
  given: Readonly<Record<string, string>>,
  model: Model,
  pins: readonly string[] | null,
  isShown: (name: string) => boolean,
): readonly string[] {
  if (parameter.words.length) return parameter.words;
  const { controllers, lines, elements } = model;
  const element = elements.find(({ name }) => name === given["element"]);
  const controller = controllers.find(({ name }) => name === given["machine"]) ?? controllers[0];
  const kept = (names: readonly string[]) => names.filter((name) => isShown(name) || name === given[parameter.name]);
  switch (parameter.name) {
    case "element":
      return kept(elements.filter((one) => kind.elements.includes(one.kind)).map(({ name }) => name));
    case "machine":
      return kept(controllers.map(({ name }) => name));
    case "axis":
      return controller?.axes.map(({ number }) => String(number)) ?? [];
    case "unit":
      return [...new Set(controllers.flatMap(({ unit }) => (unit === null ? [] : [String(unit)])))];
    case "input":
      return element?.inputs ?? [];
    case "output":
      return element?.outputs ?? [];
    case "line":
      return lines.map(({ name }) => name);
    case "pin": {
      // Only what is so all the time happens to outputs, too: they have no switch whose changes could be occasions.
      const fit = controller?.sheet.pins.filter(
        ({ direction }) => kind.occasion === "always" || direction !== "output",
      );
      return pins ?? fit?.map(({ name }) => name) ?? [];
    }
    case "value": {
      const pin = controller?.sheet.pins.find(({ name }) => name === given["pin"]);
      return pin === undefined || pin.is_analog ? [] : ["0", "1"];
    }
  }
  return [];
}
