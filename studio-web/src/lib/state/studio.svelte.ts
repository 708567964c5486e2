import {
  Connection,
  RequestError,
  saidOf,
  browserTimers,
  type ConnectionState,
  type Fields,
  type Hello,
  type RequestName,
} from "../protocol/connection";
import type { Said } from "../../text";
import type { Backend, Loading } from "../protocol/backend";
import type { Pushed, Requests, SubjectEvent } from "../protocol/types";
import { AxisState } from "./axis.svelte";
import { WorldClock, type Pace } from "./clock";
import { Edges } from "./edges";
import { EventLog } from "./events.svelte";
import { EarlierEvents, type PastEvents } from "./earlierevents.svelte";
import { TimeTravel, plansOf, type Past } from "./timetravel.svelte";
import { modelOf, type AxisModel, type ControllerModel, type Model } from "./model";
import { levelsOf, Pins } from "./pins.svelte";
import { Question } from "./question.svelte";
import { severityOf, type Severity } from "./severity";
import { wholeStep, type Stepped } from "./step";
import { Watches, type Watch } from "./watch.svelte";

export type EventKind = SubjectEvent["kind"];

const EMPTY: Model = {
  name: "",
  controllers: [],
  lines: [],
  mechanics: [],
  buttons: [],
  elements: [],
  connections: [],
  scene: { frames: [], bodies: [], cups: [], nests: [], beams: [], origins: [] },
  commands: new Set(),
};
/** Frames and statements are as frequent as requests: a panel that shows them follows them itself. */
const SUBSCRIBED: readonly EventKind[] = [
  "plan",
  "coordinate",
  "sample",
  "load",
  "free",
  "edge",
  "status",
  "note",
  "report",
  "button",
  "input",
  "fault",
  "pace",
  "restored",
];
/** Events that may wait for this page. */
const EVENTS_BOUND = 10_000;

interface Subscription {
  kinds: readonly EventKind[];
  /** Of the request; another one after a reconnection. */
  id: number;
}

export type Holder = Hello["control"];
export type Listener = (events: readonly SubjectEvent[]) => void;

export interface Notice extends Said {
  kind: "error" | "done";
  /** Of a text that is not in the language of the page. */
  lang?: "en";
}

const NOTICE_MS = 8000;
/** A step of several parts does not go on after these. */
const ENDS_STEPS: ReadonlySet<RequestName> = new Set(["stop", "stop_all", "pause", "resume", "restore", "go_back"]);

/** What the page knows of the studio, and what it asks of it. */
export class Studio {
  link = $state<ConnectionState>("connecting");
  /** News of a studio that is not there yet; null with the first state that comes from it. */
  loading = $state.raw<Exclude<Loading, { foreseen: unknown }> | null>(null);
  /** Why the studio did not accept this page. */
  refusal = $state.raw<Said>({ text: "" });
  hello = $state.raw<Hello | null>(null);
  model = $state.raw<Model>(EMPTY);
  control = $state.raw<Holder>(null);
  viewers = $state(0);
  leases = $state.raw<Hello["leases"]>([]);
  private present_workpieces = $state.raw<Hello["workpieces"]>([]);
  private present_standing = $state.raw<Hello["standing"]>([]);
  /** Why the device does not answer. */
  lost = $state<string | null>(null);
  pace = $state.raw<Pace>({ running: false, speed: 1 });
  notice = $state.raw<Notice | null>(null);
  /** Counts stops from this page, for who shows them. */
  stops = $state(0);

  /** What happened last from when on was not known, for who keeps events of a kind of his own. */
  lost_ns = $state.raw(0n);

  readonly clock = new WorldClock();
  readonly log = new EventLog((event) => this.severity(event));
  readonly pins = new Pins();
  readonly edges = new Edges();
  /** By `table.M1`. */
  axes = $state.raw<ReadonlyMap<string, AxisState>>(new Map());
  private readonly watches = new Watches((name, fields) => this.ask(name, fields));
  readonly timeTravel = new TimeTravel((name, fields, within_ms) => this.ask(name, fields, within_ms), {
    show: (past) => this.showPast(past),
    moments: () => this.moments(),
    present: () => this.present(),
    report: (error) => this.report(error),
  });
  readonly question = new Question(
    (name, fields, within_ms) => this.ask(name, fields, within_ms),
    () => this.timeTravel.moment,
  );
  readonly earlier = new EarlierEvents(
    (name, fields, within_ms) => this.ask(name, fields, within_ms),
    (part) => this.takeEarlier(part),
  );
  private readonly listeners = new Set<Listener>();
  private readonly subscriptions = new Set<Subscription>();
  private readonly connection: Connection;
  private noticeTimer = 0;
  /** Counts what was wanted of time. */
  private turns = 0;

  constructor(
    readonly backend: Backend,
    greeting: () => Fields<"hello">,
  ) {
    const events = {
      hello: (hello: Hello, isNewConnection: boolean) => {
        this.loading = null;
        this.greeted(hello, isNewConnection);
      },
      pushed: (messages: readonly Pushed[]) => messages.forEach((message) => this.pushed(message)),
      state: (state: ConnectionState, why: Said) => {
        this.link = state;
        this.refusal = why;
      },
    };
    const first = () => ({ ...greeting(), kinds: [...SUBSCRIBED] });
    backend.follow((loading) => {
      if (!("foreseen" in loading)) this.loading = loading;
      else if (this.hello === null) this.greeted(loading.foreseen, false);
    });
    this.connection = new Connection(first, events, backend.open, browserTimers);
  }

  open(): void {
    this.connection.open();
  }

  /** Nothing is shown of it any more. */
  close(): void {
    this.connection.close();
  }

  /** Says hello again, with the token that the page has now. */
  renew(): void {
    this.connection.renew();
  }

  /** The moment that is shown: the present, or one that is looked at. Virtual time. [ns] */
  now(): bigint {
    return this.timeTravel.moment ?? this.present();
  }

  /** Where the world is. Virtual time. [ns] */
  present(): bigint {
    return this.clock.now(performance.now());
  }

  /** Those in space, at the moment that is shown. */
  get workpieces(): Hello["workpieces"] {
    return this.timeTravel.past?.workpieces ?? this.present_workpieces;
  }

  /** What waits or is wrong, and since when, at the moment that is shown. */
  get standing(): Hello["standing"] {
    return this.timeTravel.past?.standing ?? this.present_standing;
  }

  get isVirtual(): boolean {
    return this.hello?.virtual ?? true;
  }

  get hasControl(): boolean {
    return this.control !== null && this.control.viewer === this.hello?.viewer;
  }

  /** Whether the role of this viewer permits a request, and the studio can do it here and now. */
  may(name: RequestName): boolean {
    return this.loading === null && ((this.timeTravel.past ?? this.hello)?.may.includes(name) ?? false);
  }

  /** Whether a request is possible only after a token has been given. */
  needsToken(name: RequestName): boolean {
    return this.hello?.with_token.includes(name) ?? false;
  }

  controller(name: string): ControllerModel | undefined {
    return this.model.controllers.find((controller) => controller.name === name);
  }

  severity(event: SubjectEvent): Severity {
    return severityOf(event, this.controller(event.controller));
  }

  axis(model: AxisModel): AxisState {
    return this.axes.get(model.id) as AxisState;
  }

  ask<N extends RequestName>(name: N, fields: Fields<N>, within_ms?: number): Promise<Requests[N]["answer"]> {
    if (ENDS_STEPS.has(name)) this.turns++;
    return this.connection.request(name, fields, within_ms);
  }

  /** A step of the world, all of it unless somebody here stops the machine or turns time meanwhile. */
  step(fields: Fields<"step">): Promise<Stepped> {
    const turns = ++this.turns;
    return wholeStep(
      (part) => this.ask("step", part) as Promise<Stepped>,
      fields,
      () => this.turns === turns,
    );
  }

  /** A request of the user: an error is shown. Gives whether it was done. */
  async act<N extends RequestName>(name: N, fields: Fields<N>): Promise<boolean> {
    try {
      await this.ask(name, fields);
      return true;
    } catch (error) {
      this.report(error);
      return false;
    }
  }

  /** What is asked while the studio is being loaded is asked again when it is there. */
  report(error: unknown): void {
    if (this.loading === null || !(error instanceof RequestError && error.code === "closed")) this.complain(error);
  }

  private complain(error: unknown): void {
    this.show({ ...saidOf(error), kind: "error", lang: "en" });
  }

  show(notice: Notice): void {
    this.notice = notice;
    clearTimeout(this.noticeTimer);
    this.noticeTimer = window.setTimeout(() => (this.notice = null), NOTICE_MS);
  }

  /** Nobody needs control for it, and every role may. */
  stopAll(): void {
    this.stops++;
    const asked = this.link === "refused" ? this.backend.stopAll() : this.ask("stop_all", {});
    asked.catch((error: unknown) => {
      this.complain(error);
      clearTimeout(this.noticeTimer); // something still moves: it stays until it is closed
    });
  }

  /** What a key does with time. Back and on go to where something happened; on from the present is a step of the world. */
  turnTime(how: "live" | "pause" | "back" | "on"): void {
    const isBack = this.timeTravel.moment !== null;
    if (how === "back") {
      if (this.may("show_moment")) this.timeTravel.step(-1);
    } else if (how === "on") {
      if (isBack) this.timeTravel.step(1);
      else if (this.may("step")) void this.act("step", {});
    } else if (how === "live" && isBack) {
      this.timeTravel.live();
    } else if (how === "pause" && this.pace.running) {
      if (this.may("pause")) void this.act("pause", {});
    } else if (!this.pace.running && this.may("resume")) {
      void this.act("resume", {});
    }
  }

  /** Values of points for as long as something shows them; gives what ends it. */
  watch(points: readonly string[], rate?: number): [Watch, () => void] {
    return this.watches.add(points, rate);
  }

  /** Events as they come, those of further kinds such as frames too; gives what ends it. */
  listen(kinds: readonly EventKind[], listener: Listener): () => void {
    this.listeners.add(listener);
    const more = kinds.filter((kind) => !SUBSCRIBED.includes(kind));
    const end = more.length ? this.subscribe(more) : () => undefined;
    return () => {
      this.listeners.delete(listener);
      end();
    };
  }

  private greeted(hello: Hello, isNewConnection: boolean): void {
    const isNew = this.hello === null || this.hello.description.name !== hello.description.name;
    this.hello = hello;
    this.control = hello.control;
    this.viewers = hello.viewers;
    this.leases = hello.leases;
    this.present_workpieces = hello.workpieces;
    this.present_standing = hello.standing;
    const now_ns = BigInt(hello.time_ns);
    this.tellClock(now_ns, hello.pace, true);
    this.forgetAfter(now_ns);
    if (isNew) this.log.forget();
    if (isNewConnection) this.log.begin(hello.events, BigInt(hello.events_from_ns), this.heard_ns);
    this.lose();
    this.heard_ns = now_ns;
    this.earlier.begin(now_ns);
    if (isNew || JSON.stringify(hello.description) !== this.description) this.describe(hello);
    for (const event of hello.plans) this.toAxis(event);
    this.pins.reset(hello.state);
    for (const [pin, level] of levelsOf(hello.state)) this.edges.take(pin, now_ns, level);
    if (!hello.virtual) this.askPins();
    if (!isNewConnection) return;
    this.timeTravel.forget();
    if (!this.log.list.length && hello.may.includes("show_moment")) void this.earlier.more(); // of a recording
    for (const subscription of this.subscriptions) this.beginSubscription(subscription);
    this.watches.renew();
  }

  /** What the page shows of the time after a moment to which the world has gone back has not happened. */
  private forgetAfter(time_ns: bigint): void {
    for (const axis of this.axes.values()) axis.forgetAfter(time_ns);
    this.edges.forgetAfter(time_ns);
    if (this.heard_ns > time_ns) this.heard_ns = time_ns;
  }

  /** What was between the last events that came and the whole state is not known, until somebody asks for it. */
  private lose(): void {
    for (const axis of this.axes.values()) axis.lose(this.heard_ns);
    this.edges.lose(this.heard_ns);
    this.lost_ns = this.heard_ns;
  }

  /** Up to here all events have come. */
  private heard_ns = 0n;
  private description = "";

  private describe(hello: Hello): void {
    this.description = JSON.stringify(hello.description);
    this.model = modelOf(hello.description);
    const axes = this.model.controllers.flatMap((controller) => controller.axes);
    this.axes = new Map(axes.map((axis) => [axis.id, new AxisState(axis)]));
  }

  private askPins(): void {
    this.ask("pins", {}).then(
      (levels) => this.pins.take(levels as Record<string, number>),
      () => undefined,
    );
  }

  /** Asks for kinds of events, again after each reconnection; gives what ends it. */
  private subscribe(kinds: readonly EventKind[]): () => void {
    const subscription: Subscription = { kinds, id: 0 };
    this.subscriptions.add(subscription);
    if (this.hello !== null) this.beginSubscription(subscription);
    return () => {
      this.subscriptions.delete(subscription);
      this.ask("unsubscribe", { subscription: subscription.id }).catch(() => undefined);
    };
  }

  private beginSubscription(subscription: Subscription): void {
    subscription.id = this.connection.newId();
    this.connection
      .request("subscribe", { kinds: [...subscription.kinds], bound: EVENTS_BOUND }, undefined, subscription.id)
      .catch((error: unknown) => this.report(error));
  }

  private pushed(message: Pushed): void {
    if ("events" in message) this.happened(message.events, message.missed, BigInt(message.time_ns));
    else if ("values" in message) this.watches.take(message.values);
    else if ("clock" in message) this.tellClock(BigInt(message.clock.time_ns), message.clock, false);
    else if ("past" in message) this.timeTravel.take(message.past);
    else if ("control" in message) this.control = message.control;
    else if ("viewers" in message) this.viewers = message.viewers;
    else if ("leases" in message) this.leases = message.leases;
    else if ("workpieces" in message) this.present_workpieces = message.workpieces;
    else if ("standing" in message) this.present_standing = message.standing;
    else if ("lost" in message) this.lost = message.lost;
  }

  private tellClock(time_ns: bigint, pace: Pace, isWhole: boolean): void {
    const now_ms = performance.now();
    if (isWhole) this.clock.reset(time_ns, pace, now_ms);
    else this.clock.tell(time_ns, pace, now_ms);
    this.pace = { running: pace.running, speed: pace.speed };
  }

  private happened(events: readonly SubjectEvent[], missed: number, time_ns: bigint): void {
    if (missed) {
      this.log.missed += missed;
      this.lose();
      this.connection.resync();
    }
    this.heard_ns = time_ns;
    this.clock.atLeast(time_ns, performance.now());
    for (const event of events) {
      this.toAxis(event);
      if (event.kind === "restored") {
        this.tellClock(BigInt(event.time_ns), { ...this.pace, running: false }, true);
        this.forgetAfter(BigInt(event.time_ns));
        this.connection.resync();
      } else if (event.kind === "edge") {
        const pin = `${event.controller}.${event.pin}`;
        this.pins.take({ [pin]: event.level });
        this.edges.take(pin, BigInt(event.time_ns), event.level);
      }
    }
    this.log.take(events);
    for (const listener of this.listeners) listener(events);
  }

  private takeEarlier({ from_ns, to_ns, state, plans, events }: PastEvents): void {
    const [begin, end] = [BigInt(from_ns), BigInt(to_ns)];
    const all = [...plans, ...events];
    this.log.takeEarlier(events, begin);
    for (const axis of this.axes.values()) {
      const { controller, number } = axis.model;
      const own = all.filter((event) => event.kind === "plan" || event.kind === "coordinate");
      const found = own.filter((event) => event.controller === controller && event.axis === String(number));
      axis.takeEarlier(found, begin, end);
    }
    const first = levelsOf(state).map(([pin, level]) => [pin, begin, level] as const);
    const edges = events.filter((event) => event.kind === "edge");
    const later = edges.map(
      (event) => [`${event.controller}.${event.pin}`, BigInt(event.time_ns), event.level] as const,
    );
    this.edges.takeEarlier([...first, ...later], begin, end);
  }

  private showPast(past: Past | null): void {
    this.pins.show(past === null ? null : past.state);
    const plans = past === null ? [] : plansOf(past);
    for (const axis of this.axes.values()) {
      const { controller, number } = axis.model;
      axis.show(plans.find((plan) => plan.controller === controller && plan.axis === String(number)) ?? null);
    }
  }

  /** Moments at which something is known to have happened, in no order. */
  private *moments(): Iterable<bigint> {
    yield* this.log.moments();
    yield* this.edges.moments();
    for (const axis of this.axes.values()) yield* axis.moments();
  }

  private toAxis(event: SubjectEvent): void {
    if (event.kind !== "plan" && event.kind !== "coordinate" && event.kind !== "sample") return;
    const controller = this.controller(event.controller);
    const model = controller?.axes.find(({ number }) => String(number) === event.axis);
    if (model !== undefined) this.axis(model).take(event);
  }
}
