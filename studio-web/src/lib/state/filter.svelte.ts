import { SvelteSet } from "svelte/reactivity";
import type { MachineModel } from "./model";

/** From so many controllers on the page offers a filter. */
const MANY = 8;

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

  fold(machines: readonly MachineModel[], isFolded: boolean): void {
    for (const { name } of machines)
      if (isFolded) this.folded.add(name);
      else this.folded.delete(name);
  }
}

export const filter = new Filter();
