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

/** What the form gives to points by the keys that `keys` has; and points of such keys that cannot be converted into the units which the
 * controller has now. */
export function pointsOf(form: Form, keys: ReadonlySet<string>): { points: Form["points"]; unknown: string[] } {
  const wanted = form.sections.flatMap((one) =>
    one.settings.filter((each) => each.point && each.text && keys.has(keyOf(one, each))).map((each) => each.point),
  );
  return {
    points: Object.fromEntries(Object.entries(form.points).filter(([point]) => wanted.includes(point))),
    unknown: wanted.filter((point) => !(point in form.points)),
  };
}

/** Keys that a text has. */
export const keysOf = (form: Form): Set<string> =>
  new Set(form.sections.flatMap((one) => one.settings.filter(({ text }) => text).map((each) => keyOf(one, each))));

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

/** Commands that keep a number which the state of a twin has: its settings, with their present numbers; null where these are unknown. */
export function settingsOf(sheet: Datasheet, details: Readonly<Record<string, unknown>>): [Command, number | null][] {
  const numbers = new Set(sheet.details.filter(({ type }) => type === "whole number").map(({ name }) => name));
  return sheet.commands.flatMap((command): [Command, number | null][] => {
    if (command.arguments.length !== 1 || !numbers.has(command.code)) return [];
    const value = details[command.code];
    return [[command, typeof value === "number" ? value : null]];
  });
}
