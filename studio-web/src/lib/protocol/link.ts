/** One WebSocket, wherever it runs. What it hands over is already read from JSON. */
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

export type OpenLink = (url: string, events: LinkEvents) => Link;

/** What the page tells the worker. */
export type ToWorker = { open: string } | { send: string } | { taken: true } | { close: true };

/** What the worker tells the page. */
export type FromWorker = { opened: true } | { messages: unknown[] } | { closed: number };

/** A WebSocket in a worker: messages are received and read there, so that the page stays free for keys. */
export const openInWorker: OpenLink = (url, events) => {
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
  tell({ open: url });
  return { send: (text) => tell({ send: text }), close: () => tell({ close: true }) };
};
