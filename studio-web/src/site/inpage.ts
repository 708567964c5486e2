import type { Backend, FileKind, Link, LinkEvents, Loading, OpenLink } from "../lib/protocol/backend";
import { errorOf, type Hello } from "../lib/protocol/connection";
import { save } from "../lib/save";
import { keep, restore } from "../lib/state/kept";
import type { Answer } from "../lib/protocol/types";
import { pack, type Linked } from "./links";
import Offline from "./Offline.svelte";
import { SerialPorts } from "./serial";
import type { FromWorker, Job, Task, Texts, ToWorker } from "./messages";

interface Waiting<T> {
  done(value: T): void;
  failed(error: Error): void;
}

const [HIDDEN, VERSION] = ["hidden.pauses", 1];
const isChoice = (value: unknown): value is boolean => typeof value === "boolean";
const ENDED = "the worker of the twin has ended";

type OfJobs = Extract<FromWorker, { job: unknown } | { results: unknown }>;

/** A worker with Python in it. It goes on when a connection to it ends. */
class PythonWorker {
  /** The last state that it gave. */
  kept?: Uint8Array;
  /** Gets what a twin says of jobs, and what comes of them. */
  ofJobs: (message: OfJobs) => void = () => undefined;
  private readonly worker = new Worker(new URL("./python.worker.ts", import.meta.url), { type: "module" });
  private readonly links = new Map<number, LinkEvents>();
  private readonly asked: Waiting<Texts>[] = [];
  private readonly askedForLink: Waiting<string>[] = [];
  private readonly offered: Waiting<string>[] = [];
  private readonly ports = new SerialPorts((message) => this.tell(message));
  private next = 1;
  private hasFailed = false;

  constructor(
    root: URL,
    task: Promise<Task>,
    private readonly loading: (loading: Loading) => void,
    private readonly swapped: () => void = () => undefined,
  ) {
    this.worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.received(data);
    this.worker.onerror = ({ message }) => this.fail(message);
    task.then(
      (start) => this.tell({ start, root: root.href }),
      (error: unknown) => this.fail(error instanceof Error ? error.message : String(error)),
    );
  }

  open(events: LinkEvents): Link {
    const number = this.next++;
    if (this.hasFailed) queueMicrotask(() => events.closed(0));
    else this.links.set(number, events);
    this.tell({ open: number });
    return { send: (send) => this.tell({ send, on: number }), close: () => this.tell({ close: number }) };
  }

  texts(): Promise<Texts> {
    this.tell({ texts: true });
    return new Promise((done, failed) => this.asked.push({ done, failed }));
  }

  link(): Promise<string> {
    this.tell({ link: true });
    return new Promise((done, failed) => this.askedForLink.push({ done, failed }));
  }

  run(run: Job): void {
    this.tell({ run });
  }

  /** What comes of the job that the twin wanted. */
  inform(news: string): void {
    this.tell({ news });
  }

  /** Time stands while the page is hidden. */
  hide(hidden: boolean): void {
    this.tell({ hidden });
  }

  /** Gives the address of a serial port that the user has chosen; null where none was. */
  async choosePort(): Promise<string | null> {
    const chosen = await this.ports.choose();
    if (chosen === null) return null;
    this.tell({ offer: chosen.number, what: chosen.what });
    return new Promise((done, failed) => this.offered.push({ done, failed }));
  }

  /** Gives its name from now on. Addresses have commas between their options. */
  async take(file: File): Promise<string> {
    const given = file.name.replace(/[^\w.-]|^[.-]/g, "_");
    this.tell({ given, content: new Uint8Array(await file.arrayBuffer()) });
    return given;
  }

  /** All that is connected to it has lost its connection, and gets no other one. */
  end(): void {
    this.hasFailed = true;
    this.worker.terminate();
    this.ports.end();
    for (const { failed } of [...this.asked, ...this.askedForLink, ...this.offered]) failed(new Error(ENDED));
    for (const events of this.links.values()) events.closed(0);
    this.links.clear();
  }

  private tell(message: ToWorker): void {
    this.worker.postMessage(message);
  }

  private fail(failed: string): void {
    this.loading({ failed });
    this.end();
  }

  private received(message: FromWorker): void {
    if ("port" in message) this.ports.take(message);
    else if ("messages" in message) {
      this.links.get(message.on)?.messages(message.messages);
      this.tell({ taken: message.on });
    } else if ("opened" in message) this.links.get(message.opened)?.opened();
    else if ("closed" in message) {
      const events = this.links.get(message.closed);
      this.links.delete(message.closed);
      events?.closed(message.code);
    } else if ("texts" in message) this.asked.shift()?.done(message.texts);
    else if ("link" in message) this.askedForLink.shift()?.done(message.link);
    else if ("address" in message) {
      const waiting = this.offered.shift();
      if (message.address === null) waiting?.failed(new Error(message.why));
      else waiting?.done(message.address);
    } else if ("file" in message) save(new Blob([message.text], { type: "application/json" }), message.file);
    else if ("kept" in message) this.kept = message.kept;
    else if ("swapped" in message) this.swapped();
    else if ("job" in message || "results" in message) this.ofJobs(message);
    else if ("progress" in message) this.loading({ phase: message.progress });
    else this.fail(message.failed);
  }
}

/** The studio inside the page: a twin in one worker; the editor server, and what runs campaigns, in others when they are asked for. */
export class InPage implements Backend {
  readonly origin = Offline;
  private twin: PythonWorker;
  private editor: PythonWorker | null = null;
  private jobs: PythonWorker | null = null;
  /** Files of the last campaign that ended. */
  private results: Texts = {};
  private tellLoading: ((loading: Loading) => void) | null = null;
  private isOther = false;
  private tellSwapped: () => void = () => undefined;

  /** `root`: where the page is; `name`: of its world, where no link gives another one. */
  constructor(
    private readonly root: URL,
    private readonly name: string,
    private readonly linked: Linked | null,
  ) {
    this.twin = this.start();
    const tell = () => this.hidden.pauses && this.twin.hide(document.hidden);
    document.addEventListener("visibilitychange", tell);
    if (document.hidden) tell();
  }

  /** `kept`: a state of a twin that has ended, from which this one goes on. */
  private start(kept?: Uint8Array): PythonWorker {
    const twin = new PythonWorker(
      this.root,
      this.task(kept),
      (loading) => {
        if ("phase" in loading) performance.mark(loading.phase);
        this.tellLoading?.(loading);
      },
      () => this.swap(true),
    );
    twin.ofJobs = (message) => {
      if (!("job" in message)) return;
      if (message.job === null) this.endJobs();
      else (this.jobs ??= this.startJobs()).run(message.job);
    };
    return twin;
  }

  private startJobs(): PythonWorker {
    const jobs = new PythonWorker(this.root, Promise.resolve({ jobs: true }), (loading) => {
      if (!("failed" in loading)) return;
      this.endJobs();
      this.twin.inform(JSON.stringify({ error: loading.failed }));
    });
    jobs.ofJobs = (message) => {
      if (!("results" in message) || jobs !== this.jobs) return;
      if (Object.keys(message.results).length) this.results = message.results;
      this.twin.inform(message.news);
    };
    return jobs;
  }

  private endJobs(): void {
    this.jobs?.end();
    this.jobs = null;
  }

  follow(listener: (loading: Loading) => void): void {
    const isLoaded = this.tellLoading !== null;
    this.tellLoading = listener;
    if (isLoaded) return;
    listener({ phase: "python" }); // before the worker says so: until then nothing can be asked
    if (this.linked !== null) return; // its state comes from the twin
    this.get(`${this.name}.hello.json`).then(
      async (response) => this.tellLoading?.({ foreseen: (await response.json()) as Hello }),
      () => undefined, // it will come from the twin
    );
  }

  /** `isOther`: whether a world is shown in place of the machine, or was. */
  private swap(isOther: boolean): void {
    this.isOther = isOther;
    this.editor?.end(); // it has the texts of the world before
    this.editor = null;
    this.tellSwapped();
  }

  swapped(listener: () => void): void {
    this.tellSwapped = listener;
  }

  take = (file: File) => this.twin.take(file);

  open: OpenLink = (path, events) => {
    if (path === "/ws") return this.twin.open(events);
    this.editor ??= new PythonWorker(
      this.root,
      this.twin.texts().then((editor): Task => ({ editor })),
      () => undefined, // the twin goes on without it, and the panel says that there is no help
    );
    return this.editor.open(events);
  };

  file(kind: FileKind, name: string): Promise<Blob> {
    const content = kind === "campaigns" ? this.results[name] : undefined;
    return content === undefined
      ? Promise.reject(new Error(`${kind}: no file ${name} in a page`))
      : Promise.resolve(new Blob([content as Uint8Array<ArrayBuffer>]));
  }

  address(): null {
    return null;
  }

  async share(): Promise<string> {
    const found = JSON.parse(await this.twin.link()) as Linked | { refused: string };
    if ("refused" in found) throw new Error(found.refused);
    return new URL(await pack(found), this.root).href;
  }

  readonly serial = {
    problem: SerialPorts.problem,
    choose: () => this.twin.choosePort(),
  };

  /** The tab is not hidden while somebody chooses. */
  readonly hidden = {
    pauses: restore(HIDDEN, VERSION, isChoice) ?? false,
    choose(pauses: boolean) {
      this.pauses = pauses;
      keep(HIDDEN, VERSION, pauses);
    },
  };

  restart(): void {
    const ended = this.twin;
    this.endJobs();
    this.twin = this.start(ended.kept);
    if (this.isOther) this.swap(false);
    this.tellLoading?.({ phase: "python" });
    ended.end();
  }

  stopAll(): Promise<void> {
    return new Promise((done, failed) => {
      const link = this.twin.open({
        opened: () => link.send('{"do":"stop_all"}'),
        messages: ([answer]) => {
          link.close();
          const { error } = answer as Answer;
          if (error) failed(errorOf(error));
          else done();
        },
        closed: () => failed(new Error(ENDED)),
      });
    });
  }

  private async task(kept?: Uint8Array): Promise<Task> {
    if (this.linked !== null) {
      const programs = Object.entries(this.linked.programs);
      const files = programs.map(([name, text]) => [name, new TextEncoder().encode(text)] as const);
      return { twin: { name: "link", text: this.linked.description, files: Object.fromEntries(files), kept } };
    }
    const { files } = (await (await this.get(`${this.name}.json`)).json()) as { files: string[] };
    const text = await (await this.get(`${this.name}.toml`)).text();
    const campaign = await (await this.get(`${this.name}.campaign.toml`)).text();
    const contents = files.map(
      async (file) => [file, new Uint8Array(await (await this.get(file)).arrayBuffer())] as const,
    );
    return { twin: { name: this.name, text, files: Object.fromEntries(await Promise.all(contents)), kept, campaign } };
  }

  private async get(file: string): Promise<Response> {
    const response = await fetch(new URL(`world/${file}`, this.root));
    if (!response.ok) throw new Error(`${response.url}: ${response.status} ${response.statusText}`);
    return response;
  }
}
