import { saidOf } from "../../../lib/protocol/connection";
import type { Said } from "../../../text";
import type { SubjectEvent } from "../../../lib/protocol/types";
import type { Studio } from "../../../lib/state/studio.svelte";

/** As the studio gives it; all viewers have the same ones. */
export interface Breakpoint {
  number: number;
  controller: string | null;
  program: string | null;
  /** Of the statement. */
  line: number | null;
  label: string | null;
  value: string | null;
  condition: string | null;
  hits: string | null;
  log: string | null;
  /** Why it is nowhere. */
  problem: string | null;
}

/** What a breakpoint is given. */
export type Wanted = Partial<
  Pick<Breakpoint, "controller" | "program" | "line" | "label" | "value" | "condition" | "hits" | "log">
>;

export interface Frame {
  name: string;
  program: string;
  source: string;
  line: number;
}

export interface Watched {
  expression: string;
  /** With its unit; null where it cannot be calculated. */
  value: string | null;
  problem: Said | null;
}

export type Stopped = Pick<
  Extract<SubjectEvent, { kind: "stopped" }>,
  "time_ns" | "controller" | "reason" | "what" | "breakpoints" | "program" | "line" | "past"
>;
type Logged = Extract<SubjectEvent, { kind: "log" }>;
export type Way = "in" | "over" | "out" | "back" | "continue" | "run_back";

export const EVENTS = ["program-error", "wrong-data", "position-error", "limit"] as const;
export type Event = (typeof EVENTS)[number];

/** Why the world stands, as the studio says it. */
export const REASONS = [
  "entry",
  "step",
  "breakpoint",
  "function breakpoint",
  "data breakpoint",
  "exception",
  "pause",
  "begin",
  "world",
  "idle",
  "limit",
] as const;

/** What tells that breakpoints, stops or values may be others. */
const FOLLOWED: readonly SubjectEvent["kind"][] = ["stopped", "log", "breakpoints", "pace", "restored"];
const WATCHED_MS = 500;
const MOST_LOGGED = 200;

/** The debugger of the world, as one page shows it: breakpoints, where it stands, values there. */
export class Debugging {
  breakpoints = $state.raw<readonly Breakpoint[]>([]);
  events = $state.raw<readonly Event[]>([]);
  /** Why time stands; null while it goes on, or stands for another reason. */
  stop = $state.raw<Stopped | null>(null);
  frames = $state.raw<readonly Frame[]>([]);
  watches = $state.raw<readonly Watched[]>([]);
  logged = $state.raw<readonly Logged[]>([]);
  /** The controller whose stack and values are shown. */
  controller = $state("");

  constructor(private readonly studio: Studio) {}

  /** Whether this viewer may use it now. */
  get canUse(): boolean {
    return this.studio.may("step_program");
  }

  /** Whether this viewer may give a value now: never in the past. */
  get canAssign(): boolean {
    return this.studio.may("set_value");
  }

  /** Whether there is anything to ask a debugger for. Without, there is none, and none is made by looking. */
  get isUsed(): boolean {
    return this.stop !== null || this.breakpoints.length + this.events.length + this.watches.length > 0;
  }

  /** Follows the debugger; gives what ends that. */
  subscribe(): () => void {
    return this.studio.listen(FOLLOWED, (events) => this.happened(events));
  }

  /** Reads what is watched while time goes on; gives what ends that. */
  readWatches(): () => void {
    const timer = setInterval(() => void this.look(), WATCHED_MS);
    return () => clearInterval(timer);
  }

  private happened(events: readonly SubjectEvent[]): void {
    for (const event of events) if (event.kind === "log") this.logged = [event, ...this.logged].slice(0, MOST_LOGGED);
    if (events.some(({ kind }) => kind !== "log" && FOLLOWED.includes(kind))) void this.refresh();
  }

  /** All panels show the moment at which the debugger stands, until the viewer looks at another one. */
  private stand(stop: Stopped | null): void {
    const before = this.stop;
    if (JSON.stringify(stop) === JSON.stringify(before)) return;
    this.stop = stop;
    if (stop?.past) this.studio.timeTravel.go(BigInt(stop.time_ns));
    else if (before?.past) this.studio.timeTravel.live();
  }

  async refresh(): Promise<void> {
    if (this.studio.hello === null) return;
    try {
      const found = (await this.studio.ask("breakpoints", {})) as {
        breakpoints: Breakpoint[];
        stop_on: Event[];
        stop: Stopped | null;
      };
      this.breakpoints = found.breakpoints;
      this.events = found.stop_on;
      this.stand(found.stop);
      await this.look();
    } catch {
      // The next time: the page shows elsewhere that the studio does not answer.
    }
  }

  private async look(): Promise<void> {
    const { controller } = this;
    const stands = this.stop !== null || (this.isUsed && !this.studio.pace.running);
    this.frames = stands && controller ? await this.ask("stack", controller) : [];
    const expressions = this.watches.map(({ expression }) => expression);
    const found = await Promise.all(expressions.map((expression) => this.evaluated(controller, expression)));
    if (controller === this.controller && expressions.length === this.watches.length) this.watches = found;
  }

  private ask(name: "stack", controller: string): Promise<readonly Frame[]> {
    return this.studio.ask(name, { controller }).then(
      (frames) => frames as readonly Frame[],
      () => [],
    );
  }

  private evaluated(controller: string, expression: string): Promise<Watched> {
    return this.studio.ask("evaluate", { controller, expression }).then(
      (found) => ({ expression, value: (found as { value: string }).value, problem: null }),
      (error: unknown) => ({ expression, value: null, problem: saidOf(error) }),
    );
  }

  // ---------------------------------------------------------------- what the user wants

  watch(expression: string): void {
    if (expression && !this.watches.some((one) => one.expression === expression))
      this.watches = [...this.watches, { expression, value: null, problem: null }];
    void this.refresh();
  }

  unwatch(expression: string): void {
    this.watches = this.watches.filter((one) => one.expression !== expression);
  }

  /** Sets a breakpoint, instead of another one where its number is given. Gives whether it is set. */
  async set(wanted: Wanted, instead: number | null = null): Promise<boolean> {
    const isSet = await this.studio.act("breakpoint", wanted);
    if (isSet && instead !== null) await this.studio.act("clear_breakpoint", { breakpoint: instead });
    await this.refresh();
    return isSet;
  }

  async clear(number: number): Promise<void> {
    await this.studio.act("clear_breakpoint", { breakpoint: number });
    await this.refresh();
  }

  at(controller: string, program: string, line: number): Breakpoint | undefined {
    return this.breakpoints.find(
      (one) => one.controller === controller && one.program === program && one.line === line,
    );
  }

  async stopOn(event: Event, isOn: boolean): Promise<void> {
    const events = isOn ? [...this.events, event] : this.events.filter((one) => one !== event);
    await this.studio.act("stop_on", { events });
    await this.refresh();
  }

  async go(way: Way): Promise<void> {
    const { controller } = this;
    if (way === "continue") await this.studio.act("run", { way: "forwards" });
    else if (way === "run_back") await this.studio.act("run", { way: "backwards" });
    else await this.studio.act("step_program", { controller, way });
    await this.refresh();
  }

  async assign(name: string, expression: string): Promise<boolean> {
    const isDone = await this.studio.act("set_value", { controller: this.controller, name, expression });
    await this.refresh();
    return isDone;
  }
}
