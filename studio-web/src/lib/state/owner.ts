import type { SubjectEvent } from "../protocol/types";

/** Who reports an event, for people: the element that it is about, which is recorded under a controller that it is connected to. */
export function ownerOf(event: SubjectEvent): string {
  const element = event.kind === "status" ? event.facts.element : undefined;
  return typeof element === "string" ? element : event.controller;
}
