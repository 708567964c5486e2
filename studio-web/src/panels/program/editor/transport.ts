import type { Transport } from "@codemirror/lsp-client";
import { greetingOf } from "../../../lib/state/greeting";

const BACK_OFF_MS = [250, 1000, 2000, 4000];

/** The connection to the editor server: hello, then messages of its protocol. It is made again whenever it is lost. */
export class EditorSocket implements Transport {
  private readonly handlers = new Set<(message: string) => void>();
  private socket: WebSocket | null = null;
  private attempts = 0;
  private hasGreeted = false;
  private isClosed = false;

  /** `opened`: messages can be sent; everything has to be said anew. `closed`: they cannot, and `why` where that is known. */
  constructor(
    private readonly url: string,
    private readonly events: { opened(): void; closed(why: string): void },
  ) {}

  open(): void {
    const socket = new WebSocket(this.url);
    let why = "";
    this.socket = socket;
    this.hasGreeted = false;
    socket.onopen = () => socket.send(JSON.stringify({ do: "hello", token: greetingOf().token }));
    socket.onmessage = ({ data }: MessageEvent<string>) => {
      if (this.hasGreeted) {
        for (const handler of this.handlers) handler(data);
        return;
      }
      const answer = JSON.parse(data) as { error?: { message: string } };
      if (answer.error) {
        why = answer.error.message;
      } else {
        this.hasGreeted = true;
        this.attempts = 0;
        this.events.opened();
      }
    };
    socket.onclose = () => {
      this.events.closed(why);
      if (this.isClosed) return;
      const wait = BACK_OFF_MS[Math.min(this.attempts++, BACK_OFF_MS.length - 1)] as number;
      setTimeout(() => this.isClosed || this.open(), wait);
    };
  }

  close(): void {
    this.isClosed = true;
    this.socket?.close();
  }

  /** What cannot be sent is lost: after a reconnection the texts are opened anew, and questions end after a time. */
  send(message: string): void {
    if (this.hasGreeted && this.socket?.readyState === WebSocket.OPEN) this.socket.send(message);
  }

  subscribe(handler: (message: string) => void): void {
    this.handlers.add(handler);
  }

  unsubscribe(handler: (message: string) => void): void {
    this.handlers.delete(handler);
  }
}
