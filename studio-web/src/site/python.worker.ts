import type { PyodideInterface } from "pyodide";
import type { PyProxy } from "pyodide/ffi";
import { Batches } from "../lib/protocol/batches";
import type { FromWorker, Job, Phase, Task, Texts, ToPort, ToWorker } from "./messages";

/** `steptwin.inpage.connections.Connections`. */
interface Connections {
  open(number: number): void;
  receive(number: number, text: string): void;
  taken(number: number, size: number): void;
  close(number: number): void;
}

/** `steptwin.inpage.editor.PageEditor`. */
interface Editor {
  connections: Connections;
}

/** `steptwin.inpage.serialports.SerialPorts`. */
interface Ports {
  add(number: number, what: string): string;
  opened(number: number): void;
  failed(number: number, why: string): void;
  received(number: number, data: PyProxy): void;
  lost(number: number, why: string): void;
}

/** `steptwin.inpage.jobs.PageJobs`. */
interface Jobs {
  run(text: string, files: PyProxy, known: PyProxy): void;
}

/** `steptwin.inpage.host.PageTwin`. */
interface Twin extends Editor {
  campaigns: { take(news: string): void };
  texts(): PyProxy;
  link(): string;
  hide(isHidden: boolean): void;
}

const BOUND = 5000;
const tell = (message: FromWorker) => self.postMessage(message);
const during = (progress: Phase) => tell({ progress });

/** What waits for the page to take it, by connection. */
class Outgoing {
  private size = 0;
  private handed = 0;
  private readonly batches: Batches<unknown>;

  constructor(private readonly on: number) {
    this.batches = new Batches((messages) => {
      [this.handed, this.size] = [this.size, 0];
      tell({ messages, on: this.on });
    }, BOUND);
  }

  add(text: string): void {
    this.size += text.length;
    this.batches.add(JSON.parse(text));
  }

  /** Gives how many characters that were. */
  taken(): number {
    const size = this.handed;
    this.batches.taken();
    return size;
  }
}

const outgoing = new Map<number, Outgoing>();

const asObject = <T>(given: PyProxy) => given.toJs({ dict_converter: Object.fromEntries }) as T;

/** `steptwin.inpage.devices.DevicePage`, `steptwin.inpage.host.TwinPage` and `steptwin.inpage.jobs.JobsPage`. */
const page = {
  opened: (number: number) => tell({ opened: number }),
  send: (number: number, text: string) => outgoing.get(number)?.add(text),
  closed: (number: number, code: number) => {
    outgoing.delete(number);
    tell({ closed: number, code });
  },
  openPort: (port: number, open: number) => tell({ port, open }),
  writePort: (port: number, data: PyProxy) =>
    tell({ port, write: data.toJs() as Uint8Array<ArrayBuffer>, at: Date.now() }),
  closePort: (port: number) => tell({ port, close: true }),
  saveText: (file: string, text: string) => tell({ file, text }),
  swapped: () => tell({ swapped: true }),
  keep: (state: PyProxy) => tell({ kept: state.toJs() as Uint8Array }),
  runJob: (job: PyProxy) => tell({ job: asObject<Job>(job) }),
  endJob: () => tell({ job: null }),
  tell: (news: string, results: PyProxy) => tell({ news, results: asObject<Texts>(results) }),
  refused: (text: string) => tell({ failed: text }),
  failed: (text: string) => console.error(text),
};

type Host = Twin | Editor | Jobs;

/** The module of a host, and the archives that it needs. */
const HOSTS = {
  twin: ["host", "steptwin"],
  editor: ["editor", "steptwin", "editor"],
  jobs: ["jobs", "steptwin", "jobs"],
} as const;

let host: Host | null = null;
let python: PyodideInterface | null = null;
let ports: Ports | null = null;
let waiting: ToWorker[] = [];

async function start(task: Task, root: string): Promise<void> {
  during("python");
  const folder = `${root}python/`;
  const { loadPyodide } = (await import(/* @vite-ignore */ `${folder}pyodide.mjs`)) as typeof import("pyodide");
  const [module, ...archives] = HOSTS["twin" in task ? "twin" : "editor" in task ? "editor" : "jobs"];
  const [pyodide, ...files] = await Promise.all([
    loadPyodide({ indexURL: folder }) as Promise<PyodideInterface>,
    ...archives.map((name) => unpacked(`${folder}${name}.modules`)),
  ]);
  python = pyodide;
  during("modules");
  // Nearly all that modules make stays: to look for what does not took a tenth of the time.
  pyodide.runPython("import gc, sys; gc.disable()");
  archives.forEach((name, i) => pyodide.FS.writeFile(`/${name}.zip`, files[i] as Uint8Array));
  // A package has one archive only: what others add to it goes into the first one.
  for (const name of archives.slice(1)) pyodide.runPython(ADD.replace("NAME", name));
  pyodide.runPython('sys.path.append("/steptwin.zip")');
  const room = pyodide.pyimport(`steptwin.inpage.${module}`);
  during("world");
  if ("twin" in task) {
    const { name, text, files, kept, campaign } = task.twin;
    const twin: Twin | undefined = room.open_twin(page, name, text, pyodide.toPy(files), pyodide.toPy(kept), campaign);
    if (twin === undefined) return;
    host = twin;
  } else if ("editor" in task) host = room.PageEditor(page, pyodide.toPy(task.editor)) as Editor;
  else host = room.PageJobs(page) as Jobs;
  pyodide.runPython("gc.freeze(); gc.enable()");
  for (const message of waiting) take(host, message);
  waiting = [];
}

const ADD = `
from zipfile import ZipFile
with ZipFile("/steptwin.zip", "a") as whole, ZipFile("/NAME.zip") as more:
    for one in more.infolist():
        whole.writestr(one, more.read(one))
`;

async function unpacked(address: string): Promise<Uint8Array> {
  const { ok, status, statusText, body } = await fetch(address);
  if (!ok || body === null) throw new Error(`${address}: ${status} ${statusText}`);
  const stream = body.pipeThrough(new DecompressionStream("gzip"));
  try {
    return new Uint8Array(await new Response(stream).arrayBuffer());
  } catch {
    throw new Error(`${address}: it did not come as it was built`);
  }
}

/** What a server has to say of the files that the browser runs itself. */
const TYPES = {
  "pyodide.mjs": ["text/javascript", "application/javascript"],
  "pyodide.asm.mjs": ["text/javascript", "application/javascript"],
  "pyodide.asm.wasm": ["application/wasm"],
};

/** Which of them the server gave wrongly: browsers do not say it. */
async function wrongFile(python: string): Promise<string | null> {
  for (const [name, types] of Object.entries(TYPES)) {
    const { ok, status, statusText, headers } = await fetch(python + name, { method: "HEAD" });
    if (!ok) return `${python}${name}: ${status} ${statusText}`;
    const type = headers.get("content-type")?.split(";")[0] ?? "no type";
    if (!types.includes(type)) return `${python}${name}: the server sends it as ${type}; it has to be ${types[0]}`;
  }
  return null;
}

/** The drivers are imported with the first port. */
function offer(number: number, what: string): void {
  try {
    ports ??= python?.pyimport("steptwin.inpage.devices").offer_devices(host, page) as Ports;
    tell({ address: ports.add(number, what), why: "" });
  } catch (error) {
    tell({ address: null, why: error instanceof Error ? error.message : String(error) });
  }
}

function takeFromPort(ports: Ports, message: ToPort): void {
  const { port } = message;
  if ("received" in message) ports.received(port, python?.toPy(message.received));
  else if ("opened" in message) ports.opened(port);
  else if ("failed" in message) ports.failed(port, message.failed);
  else ports.lost(port, message.lost);
}

function take(host: Host, message: ToWorker): void {
  if (!("connections" in host)) {
    if ("run" in message) host.run(message.run.text, python?.toPy(message.run.files), python?.toPy(message.run.known));
    return;
  }
  const { connections } = host;
  if ("news" in message) {
    if ("campaigns" in host) host.campaigns.take(message.news);
  } else if ("port" in message) {
    if (ports !== null) takeFromPort(ports, message);
  } else if ("offer" in message) offer(message.offer, message.what);
  else if ("given" in message) python?.FS.writeFile(message.given, message.content);
  else if ("open" in message) {
    outgoing.set(message.open, new Outgoing(message.open));
    connections.open(message.open);
  } else if ("send" in message) connections.receive(message.on, message.send);
  else if ("taken" in message) {
    const size = outgoing.get(message.taken)?.taken();
    if (size !== undefined) connections.taken(message.taken, size);
  } else if ("close" in message) connections.close(message.close);
  else if ("hidden" in message && "hide" in host) host.hide(message.hidden);
  else if ("link" in message && "link" in host) tell({ link: host.link() });
  else if ("texts" in message && "texts" in host) tell({ texts: asObject<Texts>(host.texts()) });
}

self.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if ("start" in data) {
    start(data.start, data.root).catch(async (error: unknown) => {
      const wrong = await wrongFile(`${data.root}python/`).catch(() => null);
      tell({ failed: wrong ?? (error instanceof Error ? error.message : String(error)) });
    });
  } else if (host === null) waiting.push(data);
  else take(host, data);
};
