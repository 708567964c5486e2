import type { ControllerModel } from "../../lib/state/model";

/** Something that is set for a move: a register by its name, or a command by its letter. */
export interface Setting {
  name: string;
  code: string;
  detail: string;
  value: number;
  unit: string;
}

/** A setting with what the controller has; null where that is not known. */
export interface Change extends Setting {
  old: number | null;
}

/** How changes come to a controller. */
export interface Sending {
  /** Values by MACHINE.POINT. */
  writes: Record<string, number>;
  /** Commands for its line; empty without any. */
  text: string;
}

/** The command that makes one controller of a line listen, where there is one. */
const SELECT = "X";

export const isPoint = (controller: ControllerModel, { code }: Setting): boolean => controller.points.has(code);

/** What has to be sent so that the controller has the values; `pick` chooses new or old ones. */
export function sendingOf(
  controller: ControllerModel,
  changes: readonly Change[],
  pick: (change: Change) => number | null,
): Sending {
  const writes: Record<string, number> = {};
  const commands: string[] = [];
  for (const change of changes) {
    const value = pick(change);
    if (value === null) continue;
    if (isPoint(controller, change)) writes[`${controller.name}.${change.code}`] = value;
    else commands.push(`${change.code}${value}`);
  }
  const isSelected = controller.sheet.commands.some(({ code }) => code === SELECT) && controller.unit !== null;
  const lines = isSelected ? [`${SELECT}${controller.unit!.toString(16).toUpperCase()}`, ...commands] : commands;
  return { writes, text: commands.length ? lines.map((line) => `${line}\r`).join("") : "" };
}

/** Those that differ from what the controller has. Single precision, as registers have it. */
export function changesOf(
  settings: readonly Setting[],
  present: ReadonlyMap<string, number | null>,
): { changes: Change[]; same: boolean } {
  const changes = settings.map((setting) => ({ ...setting, old: present.get(setting.code) ?? null }));
  return { changes, same: changes.every(({ old, value }) => old !== null && Math.fround(old) === Math.fround(value)) };
}
