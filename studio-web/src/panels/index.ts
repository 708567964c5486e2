import type { Panel } from "./panel";

const found = import.meta.glob<{ default: Panel }>("./*/panel.ts", { eager: true });

/** Every panel, in order. */
export const PANELS: readonly Panel[] = Object.values(found)
  .map((module) => module.default)
  .sort((one, other) => one.order - other.order);

export const panelOf = (id: string): Panel | undefined => PANELS.find((panel) => panel.id === id);
