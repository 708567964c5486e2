import type { Stage } from "./stage";

/** The solids of each element that has a name in a picture: not of a body that is a part of nothing else, and of an element that
 * moves something those that move, or else those that stand. */
export function namedOf({ solids, aids }: Stage): Map<string, readonly number[]> {
  const found = new Map<string, number[]>();
  const fixed = solids.slice(0, aids);
  const own = new Set(fixed.filter(({ material }) => material !== "frame").map(({ element }) => element));
  fixed.forEach(({ element, isCarried, line }, n) => {
    if (!own.has(element) || line !== undefined) return;
    const list = found.get(element) ?? [];
    if (list.length === 0 || fixed[list[0] as number]?.isCarried === isCarried) found.set(element, [...list, n]);
  });
  return found;
}

/** The value of a pin of a description, where that is a terminal of an element: these are in lower case. */
export function terminalOf(pin: string, elements: readonly { name: string }[]): string | null {
  const owner = elements.find(({ name }) => pin.startsWith(`${name}.`))?.name;
  return owner === undefined ? null : owner + pin.slice(owner.length).toLowerCase();
}
