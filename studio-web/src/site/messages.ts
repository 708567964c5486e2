import type { Loading } from "../lib/protocol/backend";

/** What a page and its workers send each other. Connections have numbers that the page gives. */

/** Contents by name. */
export type Texts = Record<string, Uint8Array>;

/** What a worker is for: a twin of a description, with the files that it names, from its beginning or a state that another worker
 * gave; or the editor server for texts by address. */
export type Task = { twin: { name: string; text: string; files: Texts; kept?: Uint8Array } } | { editor: Texts };

export type ToWorker =
  | { start: Task; root: string }
  | { open: number }
  | { send: string; on: number }
  | { taken: number }
  | { close: number }
  | { texts: true }
  | { link: true };

export type FromWorker =
  | { progress: Phase }
  | { opened: number }
  | { messages: unknown[]; on: number }
  | { closed: number; code: number }
  /** The present texts of the twin by address. */
  | { texts: Texts }
  /** JSON of `PageTwin.link`. */
  | { link: string }
  /** A state from which another worker can go on. */
  | { kept: Uint8Array }
  /** Nothing will come any more. */
  | { failed: string };

/** What a worker does before it can be used. */
export type Phase = Extract<Loading, { phase: unknown }>["phase"];
