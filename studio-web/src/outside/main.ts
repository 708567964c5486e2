import css from "../app.css?raw";
import type { Solid } from "../lib/scene/builder";
import { meshOf } from "../lib/scene/faces";
import type { Piece } from "../lib/scene/pieces";
import { colourOf } from "../lib/scene/looks";
import { terminalOf } from "../lib/scene/names";
import { palettesOf, pictureOf } from "../lib/scene/picture";
import { Stage } from "../lib/scene/stage";
import { STEP_NS, Trace } from "../lib/scene/trace";
import { VIEWS } from "../lib/scene/view";
import type { Model } from "../lib/state/model";
import { levelAt, valueAt, Workpieces, type Machine, type Recorded } from "./recorded";

/** The scene outside of the studio: one script for pages from a file and for programs, without a document. */

const PALETTES = palettesOf(css);
const SHOWN = { iso: VIEWS.oblique, front: VIEWS.front, side: VIEWS.side, top: VIEWS.top };
type ViewName = keyof typeof SHOWN;
type Theme = keyof typeof PALETTES;

const stageOf = ({ scene, elements, axes }: Machine, pieces: readonly Piece[] = []) =>
  new Stage(scene, { elements, mechanics: axes } as unknown as Model, pieces);

/** The name under which the level of a pin is known. */
const nameOf = (pin: string, { elements }: Machine) => terminalOf(pin, elements) ?? pin;

/** Levels of all pins and stalls that solids show, by what knows values by their names. */
function levelsOf(machine: Machine, valueOf: (name: string) => number | null) {
  return {
    levelOf: (pin: string) => valueOf(nameOf(pin, machine)),
    isStalled: (element: string) => valueOf(`${element}.stalled`) === 1,
  };
}

/** What has to be known of a machine to draw it: signals that move, and levels. */
function wanted(machine: Machine): { signals: readonly string[]; levels: readonly string[] } {
  const stage = stageOf(machine);
  const pins = stage.solids.flatMap(({ pin }) => (pin === null ? [] : nameOf(pin, machine)));
  const stalls = machine.axes.map(({ name }) => `${name}.stalled`);
  return { signals: stage.poses.signals, levels: [...new Set([...pins, ...stalls])] };
}

function show(stage: Stage, valueOf: (name: string) => number): void {
  const { poses, pieces } = stage;
  poses.signals.forEach((name, k) => (poses.values[k] = valueOf(name)));
  pieces.signals.forEach((name, k) => (pieces.values[k] = valueOf(name)));
  stage.update();
}

/** Solids of the elements of a machine, and of workpieces with the names of these, with their colours and the meshes that they have
 * at a size of 1, for other formats. */
function solids(machine: Machine, pieces: readonly Piece[]) {
  const { light } = PALETTES;
  const stage = stageOf(machine, pieces);
  const shapes = new Map<string, Solid["prism"]>();
  const drawn = stage.solids.flatMap((solid, n) => {
    if (solid.line !== undefined) return [];
    const own = colourOf(solid.material, solid);
    const shape = JSON.stringify(solid.prism);
    shapes.set(shape, solid.prism);
    const piece = n < stage.fixed ? null : stage.pieces.names[n - stage.fixed];
    return [{ ...solid, color: light.get(own) ?? own, piece, mesh: [...shapes.keys()].indexOf(shape) }];
  });
  return { solids: drawn, meshes: [...shapes.values()].map(meshOf) };
}

/** The last moment of a machine in a recorded run, as the text of an SVG with its name. */
function picture(recorded: Recorded, at: number, view: ViewName, width: number): string {
  return new Replay(recorded).picture(at, view, "light", width, recorded.machine.name);
}

/** So far back what bodies have drawn is looked for. [ns] */
const DRAWN_NS = 300e9;

/** A machine in a recorded run. */
class Replay {
  private readonly stage: Stage;
  private readonly workpieces: Workpieces;

  constructor(private readonly recorded: Recorded) {
    this.stage = stageOf(recorded.machine);
    this.workpieces = new Workpieces(recorded.workpieces);
  }

  /** The text of an SVG; `at`: ns from the begin of the run. */
  picture(at: number, view: ViewName, theme: Theme, width: number, title: string | null = null): string {
    const { machine, motions, levels } = this.recorded;
    this.write(at);
    const pieces = this.workpieces.at(at);
    if (this.taken !== pieces) this.stage.take((this.taken = pieces));
    show(this.stage, (name) => valueAt(motions[name] ?? [], at));
    const level = (name: string) =>
      name in motions ? valueAt(motions[name] ?? [], at) : levelAt(levels[name] ?? [], at);
    const known = levelsOf(machine, level);
    return pictureOf(this.stage, SHOWN[view], known, PALETTES[theme], width, title);
  }
  private taken: readonly Piece[] = [];

  /** Bodies draw up to a moment, from where they were at the last picture if that was before. */
  private write(at: number): void {
    const { stage, recorded } = this;
    if (![...stage.lines.values()].some((line) => line instanceof Trace)) return;
    if (!(at >= this.written)) this.written = -STEP_NS;
    for (let now = Math.max(this.written + STEP_NS, at - DRAWN_NS); now <= at; now += STEP_NS) {
      stage.poses.signals.forEach((name, k) => (stage.poses.values[k] = valueAt(recorded.motions[name] ?? [], now)));
      stage.poses.update();
      stage.trace(now);
      this.written = now;
    }
  }
  private written = NaN;
}

Object.assign(globalThis, { steptwinScene: { wanted, picture, solids, Replay } });
