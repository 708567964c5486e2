import type { Material, Solid } from "./builder";

/** How a solid looks: as its material does, as something that is on, interrupted or stalled, or as what is somewhere else perhaps. */
export type Look = Material | "on" | "stalled" | "interrupted" | "shining" | "unknown";

/** What changes how elements look. */
export interface Levels {
  levelOf: (pin: string) => number | null;
  isStalled: (element: string) => boolean;
}

/** Properties of app.css. */
const COLOURS: Readonly<Record<Look, string>> = {
  frame: "metal-strong",
  rail: "metal",
  drive: "motor",
  moving: "accent",
  rod: "metal",
  belt: "rubber",
  piece: "trace-2",
  mark: "dim",
  lamp: "rubber",
  light: "danger",
  glass: "rubber",
  shining: "good",
  ghost: "accent",
  travel: "dim",
  workspace: "trace-6",
  line: "ink",
  interrupted: "danger",
  on: "good",
  stalled: "danger-fill",
  unknown: "dim",
};

/** Of its own colour, that a lamp shows which does not shine. */
export const DARK = 0.35;

/** The colour of a solid, or a property of app.css: its own where it has one, and its state does not give it another. */
export function colourOf(look: Look, { material, color }: Solid): string {
  return (look === material || look === "shining" ? color : null) ?? `--${COLOURS[look]}`;
}

export function lookOf({ element, material, pin }: Solid, { levelOf, isStalled }: Levels, isKnown = true): Look {
  if (!isKnown) return "unknown";
  if (material === "moving" && isStalled(element)) return "stalled";
  if (pin === null || levelOf(pin) !== 1) return material;
  return material === "light" ? "interrupted" : material === "glass" ? "shining" : "on";
}
