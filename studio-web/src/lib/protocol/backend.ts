import type { Component } from "svelte";
import type { HelloMessage } from "./types";

/** One connection to a studio, wherever that is. What it hands over is already read from JSON. */
export interface Link {
  send(text: string): void;
  close(): void;
}

export interface LinkEvents {
  opened(): void;
  /** In the order in which they came. */
  messages(messages: readonly unknown[]): void;
  /** `code`: that of the WebSocket; 0 where there was none. */
  closed(code: number): void;
}

export type OpenLink = (path: "/ws" | "/editor", events: LinkEvents) => Link;

export type FileKind = "recordings" | "models" | "campaigns";

/** News of a studio that is not there yet: its state at the beginning, as far as that is known; what is being loaded; why it cannot be. */
export type Loading =
  { foreseen: HelloMessage["hello"] } | { phase: "python" | "modules" | "world" } | { failed: string };

export interface SerialPorts {
  /** Why there can be none here; null where there can. */
  readonly problem: string | null;
  /** Asks the user for one, on a click. Gives its address; null where the user does not want to. */
  choose(): Promise<string | null>;
}

export interface WhileHidden {
  /** Whether time stands then; else it goes on. It is remembered. */
  readonly pauses: boolean;
  choose(pauses: boolean): void;
}

/** The studio behind the page: a service, or a worker of the page. What it can do is in its hello, not here. */
export interface Backend {
  open: OpenLink;
  /** Tells how it is loaded, where that takes time. */
  follow(listener: (loading: Loading) => void): void;
  /** Rejects with the words of the studio. */
  file(kind: FileKind, name: string): Promise<Blob>;
  /** An address at which the browser shows a file; null where it has to be fetched. */
  address(kind: FileKind, name: string): string | null;
  /** An address that opens description and programs of the twin again; null where others do not reach it. Rejects with why there is none. */
  share: (() => Promise<string>) | null;
  /** What the page shows of where it is from, beside Share; null where there is nothing. */
  origin: Component | null;
  /** Takes a file that the user has chosen. Gives its name there: for `view_recording`, and for the option `config` of addresses. */
  take: ((file: File) => Promise<string>) | null;
  /** Called where another world is shown from now on, of which the page knows nothing; never where it cannot be. */
  swapped(listener: () => void): void;
  /** Serial ports that only the browser can reach; null where the studio reaches them itself. */
  serial: SerialPorts | null;
  /** Ends the twin, even where it does not answer, and begins another one at its last state; null where the page does not own it. */
  restart: (() => void) | null;
  /** What time does while the tab is hidden; null where the page has no say in it. */
  hidden: WhileHidden | null;
  /** Stop all where the studio does not accept this page: a stop needs no token. Rejects with the words of the studio. */
  stopAll(): Promise<void>;
}
