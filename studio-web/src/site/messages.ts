import type { Loading } from "../lib/protocol/backend";

/** What a page and its workers send each other. Connections have numbers that the page gives. */

/** Contents by name. */
export type Texts = Record<string, Uint8Array>;

/** What a worker is for: a twin of a description, with the files that it names and a campaign, from its beginning or a state that
 * another worker gave; the editor server for texts by address; or jobs, one at a time, in the midst of which it is ended. */
export type Task =
  | { twin: { name: string; text: string; files: Texts; kept?: Uint8Array; campaign?: string } }
  | { editor: Texts }
  | { jobs: true };

/** Arguments of `steptwin.inpage.jobs.PageJobs.run`. */
export interface Job {
  text: string;
  files: Texts;
  known: string[];
}

/** What a worker asks of a serial port, by its number. `at`: of the wall clock [ms]. */
export type FromPort =
  | { port: number; open: number }
  | { port: number; write: Uint8Array<ArrayBuffer>; at: number }
  | { port: number; close: true };

/** What becomes of it. `lost`: it is closed, and why; empty where that was asked. */
export type ToPort =
  | { port: number; opened: true }
  | { port: number; failed: string }
  | { port: number; received: Uint8Array }
  | { port: number; lost: string };

export type ToWorker =
  | ToPort
  /** A port that the user has chosen, by its number. */
  | { offer: number; what: string }
  /** A file that the user has chosen, and its name from now on. */
  | { given: string; content: Uint8Array }
  | { start: Task; root: string }
  | { open: number }
  | { send: string; on: number }
  | { taken: number }
  | { close: number }
  | { texts: true }
  | { link: true }
  /** Time stands while the page is hidden. */
  | { hidden: boolean }
  | { run: Job }
  /** JSON of `steptwin.inpage.jobs.JobsPage.tell`, for the twin. */
  | { news: string };

export type FromWorker =
  | FromPort
  /** The address of a port that was offered; null, and why devices cannot be used. */
  | { address: string | null; why: string }
  /** A file for the user. */
  | { file: string; text: string }
  | { progress: Phase }
  | { opened: number }
  | { messages: unknown[]; on: number }
  | { closed: number; code: number }
  /** Another world is shown. */
  | { swapped: true }
  /** The present texts of the twin by address. */
  | { texts: Texts }
  /** JSON of `PageTwin.link`. */
  | { link: string }
  /** What the twin wants of the worker for jobs: null: its end. */
  | { job: Job | null }
  /** What comes of a job: JSON for the twin, and files for the user. */
  | { news: string; results: Texts }
  /** A state from which another worker can go on. */
  | { kept: Uint8Array }
  /** Nothing will come any more. */
  | { failed: string };

/** What a worker does before it can be used. */
export type Phase = Extract<Loading, { phase: unknown }>["phase"];
