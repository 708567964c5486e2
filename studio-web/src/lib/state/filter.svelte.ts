import { SvelteSet } from "svelte/reactivity";
import type { MachineModel, Model } from "./model";

/** From so many controllers on the page offers a filter. */
const MANY = 8;

const ownerOf = (terminal: string) => terminal.split(".", 1)[0] ?? "";

/** The elements that connections lead to from these controllers, over other elements too, not over other controllers. */
function reached(from: ReadonlySet<string>, { machines, connections }: Model): ReadonlySet<string> {
  const all = new Set(machines.map(({ name }) => name));
  const found = new Set(from);
  for (let before = 0; before < found.size;) {
    before = found.size;
    for (const { source, target } of connections) {
      const ends = [ownerOf(source), ownerOf(target)];
      if (ends.some((end) => found.has(end))) for (const end of ends) if (!all.has(end)) found.add(end);
    }
  }
  return found;
}

/** Which controllers the lists of the page show, and which of them by their name alone; kept while the page is open. */
class Filter {
  text = $state("");
  readonly folded = new SvelteSet<string>();

  /** It stays in sight while it hides anything. */
  isOffered(machines: readonly MachineModel[]): boolean {
    return machines.length >= MANY || this.text !== "" || machines.some(({ name }) => this.folded.has(name));
  }

  /** Those that have each word of the filter in their name, type, line or in what their axes move. */
  of(machines: readonly MachineModel[]): readonly MachineModel[] {
    const words = this.text.toLowerCase().split(/\s+/);
    return machines.filter(({ name, sheet, line, axes }) => {
      const all = [name, sheet.title, sheet.variant, line ?? "", ...axes.map(({ mechanics }) => mechanics)];
      const text = all.join(" ").toLowerCase();
      return words.every((word) => text.includes(word));
    });
  }

  /** For lists to choose one from: what is chosen stays among them. */
  offers(machines: readonly MachineModel[], chosen: string | undefined): readonly MachineModel[] {
    const shown = new Set(this.of(machines));
    return machines.filter((machine) => shown.has(machine) || machine.name === chosen);
  }

  /** Whether controllers, axes of the mechanics and elements with these names are shown: not what only hidden controllers have. */
  shows(model: Model): (name: string) => boolean {
    const shown = new Set(this.of(model.machines).map(({ name }) => name));
    const hidden = new Set(model.machines.map(({ name }) => name).filter((name) => !shown.has(name)));
    if (hidden.size === 0) return () => true;
    const ofShown = reached(shown, model);
    const ofHidden = reached(hidden, model);
    const machineOf = new Map(model.mechanics.map(({ name, machine }) => [name, machine]));
    return (name) => {
      const machine = machineOf.get(name);
      return machine === undefined ? ofShown.has(name) || !ofHidden.has(name) : !hidden.has(machine);
    };
  }

  fold(machines: readonly MachineModel[], isFolded: boolean): void {
    for (const { name } of machines)
      if (isFolded) this.folded.add(name);
      else this.folded.delete(name);
  }
}

export const filter = new Filter();
