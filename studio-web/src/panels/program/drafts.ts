import { keep, restore } from "../../lib/state/kept";

/** Texts that were changed and not downloaded, by the name of the world and their addresses. */
type Kept = Record<string, string>;

const KEY = "drafts";
const VERSION = 1;
const MOST_CHARACTERS = 1_000_000;

const isKept = (value: unknown): value is Kept =>
  typeof value === "object" && value !== null && Object.values(value).every((text) => typeof text === "string");

export const draftOf = (world: string, address: string): string | null =>
  (restore(KEY, VERSION, isKept) ?? {})[`${world} ${address}`] ?? null;

/** Remembers a draft; null: there is none any more. What would be too much is not remembered. */
export function keepDraft(world: string, address: string, text: string | null): void {
  const drafts = { ...(restore(KEY, VERSION, isKept) ?? {}) };
  delete drafts[`${world} ${address}`];
  if (text !== null) drafts[`${world} ${address}`] = text;
  const size = Object.values(drafts).reduce((sum, one) => sum + one.length, 0);
  if (size <= MOST_CHARACTERS) keep(KEY, VERSION, drafts);
}
