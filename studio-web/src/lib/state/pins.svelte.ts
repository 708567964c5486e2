import type { Hello } from "../protocol/connection";

class Level {
  value = $state<number | null>(null);
}

/** By `table.IN3`. */
export function levelsOf(state: Hello["state"]): [string, number | null][] {
  return Object.entries(state).flatMap(([controller, { pins }]) =>
    Object.entries(pins).map(([pin, level]): [string, number | null] => [`${controller}.${pin}`, level]),
  );
}

/** The levels of all pins, by `table.IN3`: from the whole state, then from edges. */
export class Pins {
  private readonly levels = new Map<string, Level>();
  /** Counts new names, so that who asked for one in vain asks again. */
  private known = $state(0);
  /** The levels of a moment that is looked at instead. */
  private past = $state.raw<ReadonlyMap<string, number | null> | null>(null);

  /** 0, 1 or volts; null where it is not known. */
  get(name: string): number | null {
    if (this.past !== null) return this.past.get(name) ?? null;
    const level = this.levels.get(name);
    if (level !== undefined) return level.value;
    void this.known;
    return null;
  }

  reset(state: Hello["state"]): void {
    for (const [pin, level] of levelsOf(state)) this.set(pin, level);
  }

  /** Show the levels of a moment of the past; null: those of the present. */
  show(state: Hello["state"] | null): void {
    this.past = state === null ? null : new Map(levelsOf(state));
  }

  take(levels: Readonly<Record<string, number>>): void {
    for (const [name, level] of Object.entries(levels)) this.set(name, level);
  }

  private set(name: string, value: number | null): void {
    const level = this.levels.get(name);
    if (level !== undefined) {
      level.value = value;
      return;
    }
    const added = new Level();
    added.value = value;
    this.levels.set(name, added);
    this.known++;
  }
}
