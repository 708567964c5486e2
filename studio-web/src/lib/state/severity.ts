import type { SubjectEvent } from "../protocol/types";
import type { ControllerModel } from "./model";

type Entry = ControllerModel["sheet"]["events"][number];
export type Severity = Entry["severity"];

const entryOf = (event: SubjectEvent, controller: ControllerModel | undefined): Entry | undefined =>
  event.kind === "status" ? controller?.sheet.events.find(({ code }) => code === event.code) : undefined;

/** As the data sheet of its controller has it; faults are warnings, and what a script expected in vain is an alarm. */
export function severityOf(event: SubjectEvent, controller: ControllerModel | undefined): Severity {
  if (event.kind === "fault") return "warning";
  if (event.kind === "report") return "alarm";
  return entryOf(event, controller)?.severity ?? "information";
}

/** Whether a motor stops with it; null where that depends, or is not known. */
export function stopsMotor(event: SubjectEvent, controller: ControllerModel | undefined): boolean | null {
  return entryOf(event, controller)?.stops_motor ?? null;
}
