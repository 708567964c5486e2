import type { SubjectEvent } from "../protocol/types";
import type { MachineModel } from "./model";

type Entry = MachineModel["sheet"]["events"][number];
export type Severity = Entry["severity"];

const entryOf = (event: SubjectEvent, machine: MachineModel | undefined): Entry | undefined =>
  event.kind === "status" ? machine?.sheet.events.find(({ code }) => code === event.code) : undefined;

/** As the data sheet of its controller has it; faults are warnings, and what a script expected in vain is an alarm. */
export function severityOf(event: SubjectEvent, machine: MachineModel | undefined): Severity {
  if (event.kind === "fault") return "warning";
  if (event.kind === "report") return "alarm";
  return entryOf(event, machine)?.severity ?? "information";
}

/** Whether a motor stops with it; null where that depends, or is not known. */
export function stopsMotor(event: SubjectEvent, machine: MachineModel | undefined): boolean | null {
  return entryOf(event, machine)?.stops_motor ?? null;
}
