import type { Component } from "svelte";
import type { Model } from "../lib/state/model";

/** What a panel is: its folder has a `panel.ts` whose default export this is. README.md says how to add one. */
export interface Panel {
  id: string;
  /** Of its place in lists, and of its key. */
  order: number;
  title(): string;
  /** Path of an icon of 20 × 20 units, drawn as lines. */
  icon: string;
  /** Its component, loaded when it is shown first. */
  load(): Promise<{ default: Component }>;
  /** Whether it has anything to show of what there is; always without. */
  fits?(model: Model, isVirtual: boolean): boolean;
}
