import { keep, restore } from "./kept";

/** Texts that were changed and are only in the page, by the name of the world and their addresses. */
type Kept = Record<string, string>;

const KEY = "drafts";
const VERSION = 1;
const MOST_CHARACTERS = 1_000_000;

const isKept = (value: unknown): value is Kept =>
  typeof value === "object" && value !== null && Object.values(value).every((text) => typeof text === "string");

export const draftOf = (world: string, address: string): string | null =>
  (restore(KEY, VERSION, isKept) ?? {})[`${world} ${address}`] ?? null;

/** By world whether this tab keeps its drafts: another tab that has one open would write over them. */
const owned = new Map<string, boolean>();

/** Takes the drafts of a world for this tab until it is closed. Gives whether no other tab has them. */
export async function ownDrafts(world: string): Promise<boolean> {
  if (!("locks" in navigator)) owned.set(world, true); // over plain http
  if (owned.get(world)) return true;
  return new Promise((done) => {
    const hold = (lock: Lock | null) => {
      const isOwn = lock !== null || owned.get(world) === true; // by a request of this tab that came before
      owned.set(world, isOwn);
      done(isOwn);
      return lock === null ? undefined : new Promise<never>(() => undefined);
    };
    void navigator.locks.request(`steptwin.drafts ${world}`, { ifAvailable: true }, hold);
  });
}

/** Remembers a draft, unless another tab keeps those of its world; null: there is none any more. Gives whether there was room. */
export function keepDraft(world: string, address: string, text: string | null): boolean {
  if (owned.get(world) === false) return true;
  const drafts = { ...(restore(KEY, VERSION, isKept) ?? {}) };
  delete drafts[`${world} ${address}`];
  if (text !== null) drafts[`${world} ${address}`] = text;
  const size = Object.values(drafts).reduce((sum, one) => sum + one.length, 0);
  return size <= MOST_CHARACTERS && keep(KEY, VERSION, drafts);
}
