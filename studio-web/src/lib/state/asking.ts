import type { SubjectEvent } from "../protocol/types";
import type { Element, Model } from "./model";
import { ownerOf } from "./owner";

/** What to ask about an element: what it reports, else a number of it. */
export function pointOf({ name, outputs, signals }: Element): string | null {
  const own = outputs[0] ?? signals[0]?.name;
  return own === undefined ? null : `${name}.${own}`;
}

/** What to ask about an event, at its moment; null for what comes from outside, is a fault, or is about time. */
export function questionOf(event: SubjectEvent, model: Model): string | null {
  if (event.kind === "edge") return `${event.controller}.${event.pin}`;
  if (event.kind !== "status") return null;
  const owner = ownerOf(event);
  const element = model.elements.find(({ name }) => name === owner);
  // Workpieces come and go: of a belt that is their number, not what its first sensor sees.
  if (event.facts.workpiece !== undefined && element?.signals.some(({ name }) => name === "count"))
    return `${element.name}.count`;
  if (element !== undefined) return pointOf(element);
  if (event.facts.workpiece !== undefined) return null;
  const controller = model.controllers.find(({ name }) => name === event.controller);
  if (controller === undefined) return null;
  const axis = controller.axes.find(({ number }) => String(number) === event.axis);
  return axis?.status ?? controller.status ?? controller.name;
}
