import { SvelteSet } from "svelte/reactivity";
import type { ControllerModel, Model } from "./model";

/** From so many controllers on the page offers a filter. */
const MANY = 8;

const ownerOf = (terminal: string) => terminal.split(".", 1)[0] ?? "";

/** The elements that connections lead to from these controllers, over other elements too, not over other controllers. */
function reached(from: ReadonlySet<string>, { controllers, connections }: Model): ReadonlySet<string> {
  const all = new Set(controllers.map(({ name }) => name));
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
  isOffered(controllers: readonly ControllerModel[]): boolean {
    return controllers.length >= MANY || this.text !== "" || controllers.some(({ name }) => this.folded.has(name));
  }

  /** Those that have each word of the filter in their name, type, line or in what their axes move. */
  of(controllers: readonly ControllerModel[]): readonly ControllerModel[] {
    const words = this.text.toLowerCase().split(/\s+/);
    return controllers.filter(({ name, sheet, line, axes }) => {
      const all = [name, sheet.title, sheet.variant, line ?? "", ...axes.map(({ mechanics }) => mechanics)];
      const text = all.join(" ").toLowerCase();
      return words.every((word) => text.includes(word));
    });
  }

  /** For lists to choose one from: what is chosen stays among them. */
  offers(controllers: readonly ControllerModel[], chosen: string | undefined): readonly ControllerModel[] {
    const shown = new Set(this.of(controllers));
    return controllers.filter((controller) => shown.has(controller) || controller.name === chosen);
  }

  /** Whether controllers, axes of the mechanics and elements with these names are shown: not what only hidden controllers have. */
  shows(model: Model): (name: string) => boolean {
    const shown = new Set(this.of(model.controllers).map(({ name }) => name));
    const hidden = new Set(model.controllers.map(({ name }) => name).filter((name) => !shown.has(name)));
    if (hidden.size === 0) return () => true;
    const ofShown = reached(shown, model);
    const ofHidden = reached(hidden, model);
    const controllerOf = new Map(model.mechanics.map(({ name, controller }) => [name, controller]));
    return (name) => {
      const controller = controllerOf.get(name);
      return controller === undefined ? ofShown.has(name) || !ofHidden.has(name) : !hidden.has(controller);
    };
  }

  fold(controllers: readonly ControllerModel[], isFolded: boolean): void {
    for (const { name } of controllers)
      if (isFolded) this.folded.add(name);
      else this.folded.delete(name);
  }
}

export const filter = new Filter();
