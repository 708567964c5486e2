import type { Transport } from "@codemirror/lsp-client";
import type { Link, OpenLink } from "../../../lib/protocol/backend";
import { greetingOf } from "../../../lib/state/greeting";

const BACK_OFF_MS = [250, 1000, 2000, 4000];

/** The connection to the editor server: hello, then messages of its protocol. It is made again whenever it is lost. */
export class EditorSocket implements Transport {
  private readonly handlers = new Set<(message: string) => void>();
  private link: Link | null = null;
  private attempts = 0;
  private hasGreeted = false;
  private isClosed = false;

  /** `opened`: messages can be sent; everything has to be said anew. `closed`: they cannot, and `why` where that is known. */
  constructor(
    private readonly openLink: OpenLink,
    private readonly events: { opened(): void; closed(why: string): void },
  ) {}

  open(): void {
    let why = "";
    this.hasGreeted = false;
    this.link = this.openLink("/editor", {
      opened: () => this.link?.send(JSON.stringify({ do: "hello", token: greetingOf().token })),
      messages: (messages) => {
        for (const message of messages) {
          if (this.hasGreeted) {
            const text = JSON.stringify(message);
            for (const handler of this.handlers) handler(text);
            continue;
          }
          const answer = message as { error?: { message: string } };
          if (answer.error) {
            why = answer.error.message;
          } else {
            this.hasGreeted = true;
            this.attempts = 0;
            this.events.opened();
          }
        }
      },
      closed: () => {
        this.link = null;
        this.hasGreeted = false;
        this.events.closed(why);
        if (this.isClosed) return;
        const wait = BACK_OFF_MS[Math.min(this.attempts++, BACK_OFF_MS.length - 1)] as number;
        setTimeout(() => this.isClosed || this.open(), wait);
      },
    });
  }

  close(): void {
    this.isClosed = true;
    this.link?.close();
  }

  /** What cannot be sent is lost: after a reconnection the texts are opened anew, and questions end after a time. */
  send(message: string): void {
    if (this.hasGreeted) this.link?.send(message);
  }

  subscribe(handler: (message: string) => void): void {
    this.handlers.add(handler);
  }

  unsubscribe(handler: (message: string) => void): void {
    this.handlers.delete(handler);
  }
}
