import { Batches } from "./batches";
import type { FromWorker, ToWorker } from "./served";

const BOUND = 5000;

let socket: WebSocket | null = null;
const tell = (message: FromWorker) => self.postMessage(message);
const batches = new Batches<unknown>((messages) => tell({ messages }), BOUND);

function open(url: string): void {
  socket = new WebSocket(url);
  socket.onopen = () => tell({ opened: true });
  socket.onmessage = ({ data }) => batches.add(JSON.parse(data as string));
  socket.onclose = ({ code }) => tell({ closed: code });
}

self.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if ("open" in data) open(data.open);
  else if ("send" in data) socket?.send(data.send);
  else if ("taken" in data) batches.taken();
  else socket?.close();
};
