import css from "../app.css?raw";
import type { Piece } from "../lib/scene/pieces";
import { colourOf } from "../lib/scene/looks";
import { palettesOf, pictureOf } from "../lib/scene/picture";
import { Stage } from "../lib/scene/stage";
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

/** The name under which the level of a pin is known: terminals of elements are in lower case. */
function nameOf(pin: string, { elements }: Machine): string {
  const owner = elements.find(({ name }) => pin.startsWith(`${name}.`))?.name;
  return owner === undefined ? pin : owner + pin.slice(owner.length).toLowerCase();
}

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

interface Moment {
  values: Readonly<Record<string, number | null>>;
  workpieces: readonly Piece[];
}

/** A machine at one moment, as the text of an SVG. */
function picture(machine: Machine, { values, workpieces }: Moment, view: ViewName, width: number): string {
  const stage = stageOf(machine, workpieces);
  const valueOf = (name: string) => values[name] ?? null;
  show(stage, (name) => valueOf(name) ?? NaN);
  return pictureOf(stage, SHOWN[view], levelsOf(machine, valueOf), PALETTES.light, width, machine.name);
}

function show(stage: Stage, valueOf: (name: string) => number): void {
  const { poses, pieces } = stage;
  poses.signals.forEach((name, k) => (poses.values[k] = valueOf(name)));
  pieces.signals.forEach((name, k) => (pieces.values[k] = valueOf(name)));
  stage.update();
}

/** Solids of the elements of a machine, then of workpieces, with their colours, for other formats. */
function solids(machine: Machine, pieces: readonly Piece[]) {
  const { light } = PALETTES;
  return stageOf(machine, pieces).solids.map((solid) => {
    const own = colourOf(solid.material, solid);
    return { ...solid, color: light.get(own) ?? own };
  });
}

/** A machine in a recorded run. */
class Replay {
  private readonly stage: Stage;
  private readonly workpieces: Workpieces;

  constructor(private readonly recorded: Recorded) {
    this.stage = stageOf(recorded.machine);
    this.workpieces = new Workpieces(recorded.workpieces);
  }

  /** The text of an SVG; `at`: ns from the begin of the run. */
  picture(at: number, view: ViewName, theme: Theme, width: number): string {
    const { machine, motions, levels } = this.recorded;
    const pieces = this.workpieces.at(at);
    if (this.taken !== pieces) this.stage.take((this.taken = pieces));
    show(this.stage, (name) => valueAt(motions[name] ?? [], at));
    const level = (name: string) =>
      name in motions ? valueAt(motions[name] ?? [], at) : levelAt(levels[name] ?? [], at);
    const known = levelsOf(machine, level);
    return pictureOf(this.stage, SHOWN[view], known, PALETTES[theme], width);
  }
  private taken: readonly Piece[] = [];
}

Object.assign(globalThis, { steptwinScene: { wanted, picture, solids, Replay } });
