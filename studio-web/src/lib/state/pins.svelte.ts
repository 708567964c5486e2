import type { Hello } from "../protocol/connection";

class Level {
  value = $state<number | null>(null);
}

/** The levels of all pins, by `table.IN3`: from the whole state, then from edges. */
export class Pins {
  private readonly levels = new Map<string, Level>();
  /** Counts new names, so that who asked for one in vain asks again. */
  private known = $state(0);

  /** 0, 1 or volts; null where it is not known. */
  get(name: string): number | null {
    const level = this.levels.get(name);
    if (level !== undefined) return level.value;
    void this.known;
    return null;
  }

  reset(state: Hello["state"]): void {
    for (const [machine, all] of Object.entries(state)) {
      const pins = (all as { pins?: Record<string, number> }).pins ?? {};
      for (const [pin, level] of Object.entries(pins)) this.set(`${machine}.${pin}`, level);
    }
  }

  take(levels: Readonly<Record<string, number>>): void {
    for (const [name, level] of Object.entries(levels)) this.set(name, level);
  }

  private set(name: string, value: number): void {
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
