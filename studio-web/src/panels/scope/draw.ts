import type { Pen } from "../../lib/drawing/pen";
import type { Surface } from "../../lib/drawing/surface";
import { inWords } from "../../text";
import { shortNumber, shownNumber } from "../../lib/state/numbers";
import type { Severity } from "../../lib/state/severity";
import { Columns, fill, fillFrom } from "./columns";
import { drawFrames, drawStatements } from "./channels";
import { trace } from "./polyline";
import { isCurve, isChannel, isPassed, tracksOf, type Signal } from "./signals";
import { valueAt, type Sources } from "./values";
import { bounds, digitsOf, ticks, type View } from "./view";

/** Pixels. */
const LEFT = 62;
const RIGHT = 10;
const BOTTOM = 20;
const MARKS = 12;
const CHANNEL = 20;
const GAP = 14;
const LEAST_TRACK = 60;
/** Of a character of the numbers, with their font of one width. */
const CHARACTER = 6.6;

/** Lines that are told apart without colour. */
const DASHES: readonly (readonly number[])[] = [[], [7, 3], [2, 2], [9, 3, 2, 3]];

export interface Colours {
  paper: string;
  ink: string;
  dim: string;
  rule: string;
  accent: string;
  warn: string;
  danger: string;
  traces: readonly string[];
}

export interface Mark {
  time_ns: bigint;
  severity: Severity;
}

export interface Scene {
  view: View;
  now_ns: bigint;
  signals: readonly Signal[];
  marks: readonly Mark[];
  cursors: { a: bigint | null; b: bigint | null };
  /** Of the past, that the page looks at. */
  moment: bigint | null;
  trigger: { track: string; level: number } | null;
}

export const styleOf = (index: number): { trace: number; dash: readonly number[] } => ({
  trace: index % 8,
  dash: DASHES[Math.floor(index / 2) % DASHES.length] as readonly number[],
});

/** The picture of the scope. */
export class Picture {
  private columns: Columns[] = [];
  private readonly kept = new Map<string, [number, number]>();
  private readonly ctx: Pen;
  /** The width of the curves. */
  private inner = 10;

  constructor(
    private readonly surface: Surface,
    private readonly sources: Sources,
  ) {
    this.ctx = surface.pen;
  }

  /** The fraction of the width of the curves at a place of the pointer; below 0 and above 1 beside them. */
  fraction(x: number): number {
    return (x - LEFT) / this.inner;
  }

  draw(scene: Scene, colours: Colours): void {
    const { ctx } = this;
    const [width, height] = this.surface.size;
    this.inner = Math.max(10, width - LEFT - RIGHT);
    ctx.fillStyle = colours.paper;
    ctx.fillRect(0, 0, width, height);
    ctx.font = "11px 'IBM Plex Mono', 'DejaVu Sans Mono', monospace";
    ctx.textBaseline = "middle";

    const bottom = height - BOTTOM;
    this.time(scene.view, bottom, colours);
    this.marks(scene, colours);
    const channels = scene.signals.filter(isChannel);
    const tracks = tracksOf(scene.signals);
    const room = bottom - MARKS - channels.length * CHANNEL;
    const each = tracks.length ? Math.max(LEAST_TRACK, room / tracks.length) : 0;
    let top = MARKS;
    for (const { unit, signals } of tracks) {
      this.track(scene, unit, signals, top, each - GAP, colours);
      top += each;
    }
    for (const signal of channels) {
      this.channel(scene, signal, top, colours);
      top += CHANNEL;
    }
    this.cursor(scene, scene.moment, "◀", bottom, colours.warn, []);
    this.cursor(scene, scene.cursors.a, "A", bottom, colours.accent, []);
    this.cursor(scene, scene.cursors.b, "B", bottom, colours.accent, [5, 3]);
    this.surface.show(width, height);
  }

  private x({ view }: Scene, time_ns: bigint): number {
    return LEFT + (Number(time_ns - view.from_ns) / Number(view.span_ns)) * this.inner;
  }

  private line(x0: number, y0: number, x1: number, y1: number): void {
    this.ctx.beginPath();
    this.ctx.moveTo(Math.round(x0) + 0.5, Math.round(y0) + 0.5);
    this.ctx.lineTo(Math.round(x1) + 0.5, Math.round(y1) + 0.5);
    this.ctx.stroke();
  }

  private time(view: View, bottom: number, colours: Colours): void {
    const { ctx } = this;
    const span_s = Number(view.span_ns) / 1e9;
    const from_s = Number(view.from_ns) / 1e9;
    const marks = ticks(from_s, from_s + span_s, this.inner / 90);
    const digits = digitsOf(marks);
    ctx.lineWidth = 1;
    ctx.textAlign = "center";
    const right = LEFT + this.inner - 4;
    for (const mark of marks) {
      if (mark < 0) continue;
      const x = LEFT + ((mark - from_s) / span_s) * this.inner;
      ctx.strokeStyle = colours.rule;
      this.line(x, MARKS, x, bottom);
      ctx.fillStyle = colours.dim;
      const text = shownNumber(mark, digits);
      if (x + (text.length / 2 + 1) * CHARACTER <= right) ctx.fillText(text, x, bottom + 10);
    }
    ctx.textAlign = "left";
    ctx.fillText("s", right, bottom + 10);
  }

  private marks(scene: Scene, colours: Colours): void {
    for (const { time_ns, severity } of scene.marks) {
      const x = this.x(scene, time_ns);
      if (x < LEFT || x > LEFT + this.inner) continue;
      this.ctx.fillStyle = { information: colours.dim, warning: colours.warn, alarm: colours.danger }[severity];
      this.ctx.beginPath();
      this.ctx.moveTo(x - 4, 1);
      this.ctx.lineTo(x + 4, 1);
      this.ctx.lineTo(x, severity === "information" ? 6 : 10);
      this.ctx.fill();
    }
  }

  private track(
    scene: Scene,
    unit: string,
    signals: readonly Signal[],
    top: number,
    height: number,
    colours: Colours,
  ): void {
    const { ctx } = this;
    const filled = signals.map((signal) => [signal, this.filled(scene, signal)] as const);
    let [low, high] = [Infinity, -Infinity];
    for (const [, columns] of filled) {
      const [from, to] = columns.range();
      if (from < low) low = from;
      if (to > high) high = to;
    }
    [low, high] = this.steady(unit, bounds(low, high));
    const y = (value: number) => top + height - ((value - low) / (high - low)) * height;
    const marks = ticks(low, high, Math.max(1, height / 34));
    const digits = digitsOf(marks);
    ctx.lineWidth = 1;
    ctx.textAlign = "right";
    for (const mark of marks) {
      ctx.strokeStyle = mark === 0 ? colours.dim : colours.rule;
      this.line(LEFT, y(mark), LEFT + this.inner, y(mark));
      ctx.fillStyle = colours.dim;
      ctx.fillText(shownNumber(mark, digits), LEFT - 5, y(mark));
    }
    ctx.textAlign = "left";
    ctx.fillStyle = colours.ink;
    ctx.fillText(inWords(unit), LEFT + 5, top + 8);
    if (scene.trigger?.track === unit) {
      ctx.strokeStyle = colours.warn;
      ctx.setLineDash([3, 3]);
      this.line(LEFT, y(scene.trigger.level), LEFT + this.inner, y(scene.trigger.level));
      ctx.setLineDash([]);
    }
    ctx.save();
    ctx.beginPath();
    ctx.rect(LEFT, top, this.inner, height);
    ctx.clip();
    ctx.lineWidth = 1.5;
    ctx.lineJoin = "round";
    for (const [signal, columns] of filled) {
      const style = styleOf(scene.signals.indexOf(signal));
      ctx.strokeStyle = colours.traces[style.trace] as string;
      ctx.setLineDash([...style.dash]);
      ctx.beginPath();
      trace(columns, LEFT, y, ctx);
      ctx.stroke();
    }
    ctx.restore();
  }

  /** A range shrinks only when what is shown fills less than half of it: values do not jump about. */
  private steady(unit: string, [low, high]: [number, number]): [number, number] {
    const kept = this.kept.get(unit);
    const fits = kept !== undefined && kept[0] <= low && kept[1] >= high && high - low > (kept[1] - kept[0]) / 2;
    const range: [number, number] = fits ? kept : [low, high];
    this.kept.set(unit, range);
    return range;
  }

  private filled(scene: Scene, signal: Signal): Columns {
    const index = scene.signals.indexOf(signal);
    const width = Math.floor(this.inner);
    let columns = this.columns[index];
    if (columns?.width !== width) this.columns[index] = columns = new Columns(width);
    const { from_ns, span_ns } = scene.view;
    if (isCurve(signal)) {
      fill(columns, this.sources.axis(signal.axis), signal.kind, from_ns, span_ns, scene.now_ns);
      return columns;
    }
    if (signal.kind === "current") {
      fillFrom(columns, (at) => valueAt(this.sources, signal, at), from_ns, span_ns, scene.now_ns);
      return columns;
    }
    const found = columns;
    found.clear();
    if (isPassed(signal)) return found;
    const until = from_ns + span_ns < scene.now_ns ? from_ns + span_ns : scene.now_ns;
    this.sources.edges.intervals(signal.pin, from_ns, until, (begin, end, level) => {
      if (Number.isNaN(level)) return;
      const [first, last] = [begin, end].map((at) => (Number(at - from_ns) / Number(span_ns)) * width) as [
        number,
        number,
      ];
      for (let column = Math.floor(first); column <= last; column++) found.add(column, level);
    });
    return found;
  }

  private channel(scene: Scene, signal: Signal, top: number, colours: Colours): void {
    const { ctx } = this;
    const colour = colours.traces[styleOf(scene.signals.indexOf(signal)).trace] as string;
    const [low, high] = [top + CHANNEL - 5, top + 4];
    ctx.textAlign = "right";
    ctx.fillStyle = colours.ink;
    const name = isPassed(signal) ? signal.source : signal.label;
    ctx.fillText(name.length > 8 ? `…${name.slice(-7)}` : name, LEFT - 5, top + CHANNEL / 2);
    ctx.strokeStyle = colour;
    ctx.lineWidth = 1.5;
    const { from_ns, span_ns } = scene.view;
    const until = from_ns + span_ns < scene.now_ns ? from_ns + span_ns : scene.now_ns;
    if (isPassed(signal)) {
      const { passed } = this.sources;
      const x = (time_ns: bigint) => this.x(scene, time_ns);
      const channel = { left: LEFT, right: LEFT + this.inner, high, low, from_ns, to_ns: until, x };
      if (signal.kind === "frames") drawFrames(ctx, channel, passed, signal.source, colour, colours.danger);
      else drawStatements(ctx, channel, passed, signal.source, colour, colours.ink);
      return;
    }
    if (signal.kind !== "level") return;
    let before: number | null = null;
    ctx.beginPath();
    this.sources.edges.intervals(signal.pin, from_ns, until, (begin, end, level) => {
      const [x0, x1] = [this.x(scene, begin), this.x(scene, end)];
      if (Number.isNaN(level)) {
        before = null;
        return;
      }
      const y = level > 0 ? high : low;
      if (before !== null) ctx.lineTo(x0, y);
      else ctx.moveTo(x0, y);
      ctx.lineTo(x1, y);
      if (level > 0) {
        ctx.save();
        ctx.globalAlpha = 0.18;
        ctx.fillStyle = colour;
        ctx.fillRect(x0, high, Math.max(1, x1 - x0), low - high);
        ctx.restore();
      }
      before = y;
    });
    ctx.stroke();
  }

  private cursor(
    scene: Scene,
    time_ns: bigint | null,
    name: string,
    bottom: number,
    colour: string,
    dash: readonly number[],
  ): void {
    if (time_ns === null) return;
    const x = this.x(scene, time_ns);
    if (x < LEFT || x > LEFT + this.inner) return;
    const { ctx } = this;
    ctx.strokeStyle = ctx.fillStyle = colour;
    ctx.lineWidth = 1;
    ctx.setLineDash([...dash]);
    this.line(x, MARKS, x, bottom);
    ctx.setLineDash([]);
    ctx.textAlign = "center";
    ctx.fillText(name, x, bottom - 8);
  }
}

/** Of the page, as its theme has them. */
export function coloursOf(element: Element): Colours {
  const style = getComputedStyle(element);
  const colour = (name: string) => style.getPropertyValue(`--${name}`).trim();
  return {
    paper: colour("paper"),
    ink: colour("ink"),
    dim: colour("dim"),
    rule: colour("rule"),
    accent: colour("accent"),
    warn: colour("warn"),
    danger: colour("danger"),
    traces: Array.from({ length: 8 }, (_, index) => colour(`trace-${index + 1}`)),
  };
}

/** A span in the unit that suits it. */
export function shownSpan(span_ns: bigint): string {
  const span = Number(span_ns);
  for (const [unit, size] of [
    ["h", 3.6e12],
    ["min", 6e10],
    ["s", 1e9],
    ["ms", 1e6],
  ] as const) {
    if (span >= size) return `${shortNumber(Number((span / size).toPrecision(3)))} ${unit}`;
  }
  return `${shortNumber(span / 1e3)} µs`;
}
