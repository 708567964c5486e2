import type { OpenLink, Link } from "./backend";
import type { Said } from "../../text";
import { en } from "../../text/en";
import { fill } from "../../text/texts.svelte";
import type { Answer, HelloMessage, Pushed, Requests, Sentence } from "./types";

export type Hello = HelloMessage["hello"];
export type RequestName = keyof Requests;
export type Fields<N extends RequestName> = Omit<Requests[N]["request"], "do" | "id" | "version">;
type Greeting = Omit<Requests["hello"]["request"], "do" | "id">;
/** Version of the messages for which the page was written; a studio with another one refuses it. */
const VERSION: Greeting["version"] = 2;
export type ErrorCode = NonNullable<Answer["error"]>["code"] | "closed" | "timeout";

/** A request that was not done. The message is the server's own, which names value, permitted range and place. */
export class RequestError extends Error {
  constructor(
    readonly code: ErrorCode,
    message: string,
    readonly sentence?: Sentence,
  ) {
    super(message);
  }

  get said(): Said {
    return { text: this.message, message: this.sentence };
  }
}

/** An error of the page itself, whose texts are its own. */
function own(code: ErrorCode, key: keyof typeof en, values: Record<string, string | number> = {}): RequestError {
  return new RequestError(code, fill(en[key], values), { id: `page.${key}`, values });
}

/** What to show of a rejection. */
export function saidOf(error: unknown): Said {
  return error instanceof RequestError ? error.said : { text: error instanceof Error ? error.message : String(error) };
}

export function errorOf({ code, message, messages }: NonNullable<Answer["error"]>): RequestError {
  return new RequestError(code, message, messages?.message);
}

export interface ConnectionEvents {
  /** The whole state. On a connection that is not new, what is watched and followed goes on. */
  hello(hello: Hello, isNewConnection: boolean): void;
  /** What was pushed since the last call, without hello and without gaps. */
  pushed(messages: readonly Pushed[]): void;
  state(state: ConnectionState, why: Said): void;
}

/** `silent`: the connection is there, and nothing comes over it. `refused`: hello was answered with an error, for want of the right
 * token until `renew`. */
export type ConnectionState = "connecting" | "open" | "silent" | "refused";

export interface Timers {
  set(call: () => void, ms: number): number;
  clear(timer: number): void;
}

const BACK_OFF_MS = [100, 250, 500, 1000, 2000, 4000];
const ANSWER_MS = 5000;
/** The clock comes once a second. */
const SILENT_MS = 2500;
const GIVE_UP_MS = 8000;
/** The code with which the studio closes a connection that gives no token, or a wrong one. */
const NO_TOKEN = 4401;

interface Waiting {
  done(value: unknown): void;
  failed(error: RequestError): void;
  timer: number;
}

/** The connection of the page: requests as promises, hello, numbered messages, reconnection with back-off. */
export class Connection {
  private link: Link | null = null;
  private isOpen = false;
  /** Of the last message; null before the whole state has come over this connection. */
  private seq: number | null = null;
  private resyncs = false;
  private nextId = 1;
  private readonly waiting = new Map<number, Waiting>();
  private attempts = 0;
  private watchdog = 0;
  private stateNow: ConnectionState = "connecting";
  private hasEnded = false;

  constructor(
    private readonly greeting: () => Fields<"hello">,
    private readonly events: ConnectionEvents,
    private readonly openLink: OpenLink,
    private readonly timers: Timers,
  ) {}

  open(): void {
    this.link = this.openLink("/ws", {
      opened: () => this.opened(),
      messages: (messages) => this.received(messages),
      closed: (code) => this.closed(code),
    });
  }

  /** It is not opened again. */
  close(): void {
    this.timers.clear(this.watchdog);
    this.isOpen = false;
    this.hasEnded = true;
    this.link?.close();
  }

  /** Greets the studio anew, such as with another token. */
  renew(): void {
    if (this.link !== null) {
      this.link.close();
    } else if (this.stateNow === "refused") {
      this.enter("connecting");
      this.open();
    }
  }

  /** Done when the answer is there; rejected with a `RequestError`. `id` is one from `newId`, for requests that are referred to. */
  request<N extends RequestName>(
    name: N,
    fields: Fields<N>,
    within_ms: number = ANSWER_MS,
    id: number = this.newId(),
  ): Promise<Requests[N]["answer"]> {
    if (!this.isOpen || this.link === null) {
      return Promise.reject(own("closed", "notConnected"));
    }
    const promise = new Promise<unknown>((done, failed) => {
      const timer = this.timers.set(() => {
        this.waiting.delete(id);
        failed(own("timeout", "noAnswer", { name, seconds: within_ms / 1000 }));
      }, within_ms);
      this.waiting.set(id, { done, failed, timer });
    });
    this.link.send(JSON.stringify({ do: name, ...fields, id }));
    return promise as Promise<Requests[N]["answer"]>;
  }

  newId(): number {
    return this.nextId++;
  }

  /** The whole state once more. What is pushed until it has come is left out: the state has it. */
  resync(): void {
    if (this.seq === null || this.resyncs) return;
    this.resyncs = true;
    this.request("resync", {}).catch(() => this.link?.close());
  }

  private opened(): void {
    this.isOpen = true;
    this.seq = null;
    this.resyncs = false;
    this.watch();
    const greeting: Greeting = { version: VERSION, ...this.greeting() };
    this.request("hello", greeting).catch((error: RequestError) => {
      if (error.code !== "closed") this.enter("refused", error.said);
    });
  }

  private closed(code: number): void {
    if (this.hasEnded) return;
    this.isOpen = false;
    this.link = null;
    this.timers.clear(this.watchdog);
    const error = own("closed", "connectionLost");
    for (const [id, waiting] of this.waiting) this.reject(id, waiting, error);
    if (code === NO_TOKEN && this.stateNow === "refused") return; // it would be refused again
    this.enter("connecting");
    const wait = BACK_OFF_MS[Math.min(this.attempts++, BACK_OFF_MS.length - 1)] as number;
    this.timers.set(() => this.open(), wait);
  }

  private reject(id: number, waiting: Waiting, error: RequestError): void {
    this.waiting.delete(id);
    this.timers.clear(waiting.timer);
    waiting.failed(error);
  }

  private received(messages: readonly unknown[]): void {
    if (this.hasEnded) return;
    this.watch();
    let news: Pushed[] = [];
    for (const message of messages as readonly (Answer | Pushed)[]) {
      if (!("seq" in message)) {
        this.answered(message);
      } else if ("hello" in message) {
        news = [];
        this.greeted(message);
      } else if (this.inOrder(message.seq)) {
        news.push(message);
      }
    }
    if (news.length) this.events.pushed(news);
  }

  private greeted(message: HelloMessage): void {
    const isNewConnection = this.seq === null;
    this.seq = message.seq;
    this.resyncs = false;
    this.attempts = 0;
    this.events.hello(message.hello, isNewConnection);
    this.enter("open");
  }

  /** Whether a message is the next one. After a gap nothing is, until the whole state has come. */
  private inOrder(seq: number): boolean {
    if (this.seq === null || this.resyncs) return false;
    if (seq === this.seq + 1) {
      this.seq = seq;
      return true;
    }
    this.resync();
    return false;
  }

  private answered(answer: Answer): void {
    const waiting = this.waiting.get(answer.id as number);
    if (waiting === undefined) return;
    this.waiting.delete(answer.id as number);
    this.timers.clear(waiting.timer);
    if (answer.error) waiting.failed(errorOf(answer.error));
    else waiting.done(answer.ok);
  }

  private watch(): void {
    this.timers.clear(this.watchdog);
    if (this.stateNow === "silent") this.enter("open");
    this.watchdog = this.timers.set(() => {
      if (this.stateNow === "open") this.enter("silent");
      this.watchdog = this.timers.set(() => this.link?.close(), GIVE_UP_MS - SILENT_MS);
    }, SILENT_MS);
  }

  private enter(state: ConnectionState, why: Said = { text: "" }): void {
    if (state === this.stateNow) return;
    this.stateNow = state;
    this.events.state(state, why);
  }
}

export const browserTimers: Timers = {
  set: (call, ms) => window.setTimeout(call, ms),
  clear: (timer) => window.clearTimeout(timer),
};
