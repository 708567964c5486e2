import { terminalOf } from "../../lib/scene/names";
import type { Element } from "../../lib/state/model";

/** Levels of pins of controllers and of terminals of elements, by the names that descriptions give them. */
export interface Levels {
  of: (pin: string) => number | null;
  /** The pin without its controller, the terminal with its element. */
  nameOf: (pin: string) => string;
}

export function levelsOf(
  elements: readonly Element[],
  pins: (pin: string) => number | null,
  values: (name: string) => number | null,
): Levels {
  return {
    of: (pin) => {
      const terminal = terminalOf(pin, elements);
      return terminal === null ? pins(pin) : values(terminal);
    },
    nameOf: (pin) => terminalOf(pin, elements) ?? pin.slice(pin.indexOf(".") + 1),
  };
}
