import type { Hello } from "../protocol/connection";
import type { ControllerModel } from "./model";

/** Something that stands: a program that waits, an alarm, an element, a fault that is set. */
export type Standing = Hello["standing"][number];

/** What is written before it. */
export const SIGNS: Readonly<Record<Standing["kind"], string>> = {
  program: "…",
  alarm: "✕",
  axis: "▲",
  element: "▲",
  fault: "⚡",
  gateway: "✕",
};

/** What stands of a thing and its parts: of `table` also what is of `table.M1`. */
export const standingOf = (all: readonly Standing[], name: string): readonly Standing[] =>
  all.filter((one) => one.name === name || one.name.startsWith(`${name}.`));

/** That of a controller, and of what its axes move. */
export const standingWith = (all: readonly Standing[], { name, axes }: ControllerModel): readonly Standing[] =>
  [name, ...axes.flatMap(({ mechanics }) => (mechanics ? [mechanics] : []))].flatMap((one) => standingOf(all, one));
