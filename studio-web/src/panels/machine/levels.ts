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
  /** Its name as a value, where it is a terminal of an element. */
  const terminalOf = (pin: string): string | null => {
    const owner = elements.find(({ name }) => pin.startsWith(`${name}.`))?.name;
    return owner === undefined ? null : owner + pin.slice(owner.length).toLowerCase();
  };
  return {
    of: (pin) => {
      const terminal = terminalOf(pin);
      return terminal === null ? pins(pin) : values(terminal);
    },
    nameOf: (pin) => terminalOf(pin) ?? pin.slice(pin.indexOf(".") + 1),
  };
}
