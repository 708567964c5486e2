import { tokenHeaders } from "../state/greeting";
import type { Backend, FileKind, OpenLink } from "./backend";
import { errorOf } from "./connection";
import type { Answer } from "./types";

/** What the page tells the worker. */
export type ToWorker = { open: string } | { send: string } | { taken: true } | { close: true };

/** What the worker tells the page. */
export type FromWorker = { opened: true } | { messages: unknown[] } | { closed: number };

/** A WebSocket in a worker: messages are received and read there, so that the page stays free for keys. */
const open: OpenLink = (path, events) => {
  const worker = new Worker(new URL("./socket.worker.ts", import.meta.url), { type: "module" });
  const tell = (message: ToWorker) => worker.postMessage(message);
  worker.onmessage = ({ data }: MessageEvent<FromWorker>) => {
    if ("messages" in data) {
      events.messages(data.messages);
      tell({ taken: true });
    } else if ("opened" in data) {
      events.opened();
    } else {
      worker.terminate();
      events.closed(data.closed);
    }
  };
  worker.onerror = () => {
    worker.terminate();
    events.closed(0);
  };
  tell({ open: `${location.origin.replace(/^http/, "ws")}${path}` });
  return { send: (text) => tell({ send: text }), close: () => tell({ close: true }) };
};

const addressOf = (kind: FileKind, name: string) => `/api/${kind}/${name.split("/").map(encodeURIComponent).join("/")}`;

/** The service that has sent the page. */
export const served: Backend = {
  share: null,
  origin: null,
  restart: null,
  hidden: null,
  take: null,
  swapped: () => undefined,
  serial: null,
  open,
  follow: () => undefined,
  async file(kind, name) {
    const response = await fetch(addressOf(kind, name), { headers: tokenHeaders() });
    if (response.ok) return response.blob();
    const answer = (await response.json().catch(() => null)) as Answer | null;
    throw answer?.error ? errorOf(answer.error) : `${response.status} ${response.statusText}`;
  },
  /** A page that needs a token cannot be opened by an address. */
  address: (kind, name) => (Object.keys(tokenHeaders()).length ? null : addressOf(kind, name)),
  async stopAll() {
    const response = await fetch("/api/do/stop_all", { method: "POST", body: "{}" });
    const answer = (await response.json()) as Answer;
    if (answer.error) throw errorOf(answer.error);
  },
};
