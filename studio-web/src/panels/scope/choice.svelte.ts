import { keep, restore } from "../../lib/state/kept";
import type { Model } from "../../lib/state/model";
import { signalsOf, usual, type Signal } from "./signals";
import { t } from "./text";

const VERSION = 1;
/** Signals shown at once. */
export const MOST = 16;

const isIds = (value: unknown): value is string[] =>
  Array.isArray(value) && value.every((id) => typeof id === "string");

/** Which signals are shown; remembered for a world by its name. */
export class Choice {
  private chosen = $state.raw<readonly string[] | null>(null);

  constructor(private readonly model: () => Model) {}

  readonly all = $derived.by((): Signal[] => signalsOf(this.model(), (quantity) => t(quantity)));
  readonly shown = $derived.by((): Signal[] => {
    const ids = this.ids;
    return ids.map((id) => this.all.find((signal) => signal.id === id)).filter((signal) => signal !== undefined);
  });

  private get ids(): readonly string[] {
    return this.chosen ?? restore(this.key, VERSION, isIds) ?? usual(this.all);
  }

  private get key(): string {
    return `scope.signals.${this.model().name}`;
  }

  has(signal: Signal): boolean {
    return this.shown.includes(signal);
  }

  toggle(signal: Signal): void {
    const without = this.shown.filter((one) => one !== signal).map(({ id }) => id);
    this.chosen = this.has(signal) ? without : [...without, signal.id].slice(-MOST);
    keep(this.key, VERSION, this.chosen);
  }
}
