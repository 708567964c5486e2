import { readFault, type FaultKind } from "../../lib/state/faults.svelte";
import type { Connection, Model } from "../../lib/state/model";
import { SIGNS, type Standing } from "../../lib/state/standing";

/** An element or axis of a machine: which faults can happen to it, and which are about it. */
export class Afflicted {
  readonly wires: readonly Connection[];
  /** The controller that its wires lead to, and its pins; null for several. */
  readonly pins: readonly string[] | null;
  private readonly controller: string | undefined;
  private readonly ends: ReadonlySet<string>;

  constructor(
    private readonly model: Model,
    private readonly name: string,
  ) {
    const isIts = (end: string) => this.isIts(end);
    this.wires = model.connections.filter(({ source, target }) => isIts(source) || isIts(target));
    this.ends = new Set(this.wires.flatMap(({ source, target }) => [source, target]).filter((end) => !isIts(end)));
    const pins = [...this.ends].map((end) => end.split(".", 2) as [string, string]);
    const controllers = new Set(
      pins.map(([of]) => of).filter((of) => model.controllers.some(({ name }) => name === of)),
    );
    this.controller = controllers.size === 1 ? [...controllers][0] : undefined;
    this.pins = this.controller === undefined ? null : pins.flatMap(([of, pin]) => (of === this.controller ? pin : []));
  }

  /** What a fault of a kind is given so that it happens to this; null: it cannot. */
  fixed(kind: FaultKind): Readonly<Record<string, string>> | null {
    const takes = (parameter: string) => kind.parameters.some(({ name }) => name === parameter);
    const element = this.model.elements.find(({ name }) => name === this.name);
    if (element !== undefined && kind.elements.includes(element.kind)) return { element: this.name };
    const axis = this.model.mechanics.find(({ name }) => name === this.name);
    if (axis !== undefined && takes("axis")) return { machine: axis.controller, axis: axis.axis };
    return this.controller !== undefined && takes("pin") ? { machine: this.controller } : null;
  }

  /** Whether a fault that is set is about this, or about a pin that it is wired to. */
  has(fault: string): boolean {
    const { given } = readFault(fault);
    const machine = given["machine"] ?? this.model.controllers[0]?.name ?? "";
    const { pin, axis } = given;
    if (pin !== undefined && this.ends.has(`${machine}.${pin}`)) return true;
    if (axis !== undefined && this.moves(machine, axis)) return true;
    return Object.values(given).some((one) => this.isIts(one));
  }

  /** Whether a place is this, its drive, or a pin that it is wired to. */
  isAt(place: string): boolean {
    const [of = "", part = ""] = place.split(".", 2);
    return this.isIts(place) || this.ends.has(place) || (part.startsWith("M") && this.moves(of, part.slice(1)));
  }

  private moves(machine: string, number: string): boolean {
    return this.model.mechanics.some(
      ({ name, controller, axis }) => name === this.name && controller === machine && axis === number,
    );
  }

  private isIts(end: string): boolean {
    return end === this.name || end.startsWith(`${this.name}.`);
  }
}

/** Elements and axes at which something stands, with its sign: of several the first, which is what is worst. */
export function signsOf(model: Model, standing: readonly Standing[]): ReadonlyMap<string, string> {
  const found = new Map<string, string>();
  if (standing.length === 0) return found;
  for (const { name } of [...model.mechanics, ...model.elements]) {
    const its = new Afflicted(model, name);
    const one = standing.find((stands) => its.isAt(stands.name));
    if (one !== undefined) found.set(name, SIGNS[one.kind]);
  }
  return found;
}
