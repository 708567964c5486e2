import type { Requests } from "../../lib/protocol/types";
import type { Datasheet } from "../../lib/state/model";

export type Form = Requests["configuration"]["answer"];
export type Section = Form["sections"][number];
export type Setting = Section["settings"][number];
export type Command = Datasheet["commands"][number];

/** A register that would change: its point, what it has, and what it would get. */
export interface Change {
  point: string;
  old: number | null;
  value: number;
}

export function changesOf(points: Form["points"], present: ReadonlyMap<string, number | null>): Change[] {
  return Object.entries(points)
    .map(([point, value]) => ({ point, value, old: present.get(point) ?? null }))
    .filter(({ old, value }) => old === null || Math.fround(old) !== Math.fround(value));
}

/** The value as people see it: the word of a choice, else what is written. */
export const shownText = ({ text, value, choices }: Setting): string =>
  choices[String(value)] ?? (text || String(value));

/** Keys of settings that are not as in another form. */
export function changedKeys(before: Form, now: Form): Set<string> {
  const old = new Map(before.sections.flatMap((one) => one.settings.map((each) => [keyOf(one, each), each.text])));
  return new Set(
    now.sections.flatMap((one) =>
      one.settings.filter((each) => old.get(keyOf(one, each)) !== each.text).map((each) => keyOf(one, each)),
    ),
  );
}

export const keyOf = (section: Section, setting: Setting): string => `${section.name}.${setting.name}`;

/** Commands that keep a number which the controller shows in its state: its settings. */
export function settingsOf(sheet: Datasheet, details: Readonly<Record<string, unknown>>): [Command, number][] {
  return sheet.commands.flatMap((command): [Command, number][] => {
    const value = details[command.code];
    return command.arguments.length === 1 && typeof value === "number" ? [[command, value]] : [];
  });
}
