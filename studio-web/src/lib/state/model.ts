import type { Description, Sentence } from "../protocol/types";

/** What there is, from the description alone: no panel asks which kind a controller is. */

export type Datasheet = Description["datasheets"][number];
export type Point = Datasheet["points"][number];
export type Pin = Datasheet["pins"][number];
export type AxisSheet = Datasheet["axes"][number];
export type Line = Description["lines"][number];
/** What an axis of a controller moves. */
export type Mechanics = Description["axes"][number];
/** What is around the controllers and is no axis and no button, such as a cylinder. */
export type Element = Description["elements"][number];
/** What drives an input. */
export type Connection = Description["connections"][number];
export type Control = "enable" | "move" | "home" | "jog" | "stop" | "program";

/** An axis of a controller, with the points of its data sheet that are about it. */
export interface AxisModel {
  /** `table.M1`, as points and conditions name it. */
  id: string;
  controller: string;
  number: number;
  /** `M1`. */
  name: string;
  /** As a person names it: `M1`, `drum` where a controller has one axis, `table M1` where two controllers have an M1. */
  label: string;
  /** That of the mechanics it drives, such as `x`; empty without. */
  mechanics: string;
  unit: string;
  pulses_per_unit: number | null;
  /** Digits after the point that one pulse makes a difference in. */
  decimals: number;
  /** Full names of points, null where the controller has none: see `axisPoint`. */
  status: string | null;
  enabled: string | null;
  velocityPoint: string | null;
  positionPoint: string | null;
  /** The point with the greatest velocity of moves. */
  fastest: string | null;
  /** What it can be commanded to do; null where that is not known. */
  positions: AxisSheet["positions"];
  distances: AxisSheet["distances"];
  velocities: AxisSheet["velocities"];
  limits: [string, string] | null;
}

export interface ControllerModel {
  name: string;
  /** A device: its positions are samples, and it may move something. */
  isReal: boolean;
  /** Why no twin can be put beside a device; null where one can. */
  noTwin: { text: string; message: Sentence | undefined } | null;
  sheet: Datasheet;
  line: string | null;
  unit: number | null;
  controls: ReadonlySet<Control>;
  axes: readonly AxisModel[];
  points: ReadonlyMap<string, Point>;
  /** Of the controller as a whole. */
  status: string | null;
  program: string | null;
}

export interface Model {
  name: string;
  controllers: readonly ControllerModel[];
  lines: readonly Line[];
  mechanics: readonly Mechanics[];
  buttons: readonly string[];
  elements: readonly Element[];
  connections: readonly Connection[];
  scene: Description["scene"];
  commands: ReadonlySet<string>;
}

const MOST_DECIMALS = 4;

export function decimalsOf(pulses_per_unit: number | null): number {
  if (pulses_per_unit === null) return 3;
  return Math.min(MOST_DECIMALS, Math.max(0, Math.ceil(Math.log10(pulses_per_unit))));
}

/** Data sheets name the points of an axis `M1.position`; a controller with one axis may leave the axis out. */
function axisPoint(sheet: Datasheet, points: ReadonlyMap<string, Point>, axis: AxisSheet, what: string): string | null {
  const named = `${axis.name}.${what}`;
  if (points.has(named)) return named;
  return sheet.axes.length === 1 && points.has(what) ? what : null;
}

function axisModel(
  controller: string,
  sheet: Datasheet,
  points: ReadonlyMap<string, Point>,
  axis: AxisSheet,
  mechanics: string,
): AxisModel {
  const full = (path: string | null) => (path === null ? null : `${controller}.${path}`);
  const find = (what: string) => full(axisPoint(sheet, points, axis, what));
  const register = (name: string) => full(points.has(`${axis.name}_${name}`) ? `${axis.name}_${name}` : null);
  const [left, right] = [register("POSLIM_L"), register("POSLIM_R")];
  return {
    id: `${controller}.${axis.name}`,
    controller,
    number: axis.number,
    name: axis.name,
    label: axis.name,
    mechanics,
    unit: axis.unit,
    pulses_per_unit: axis.pulses_per_unit,
    decimals: decimalsOf(axis.pulses_per_unit),
    status: find("status"),
    enabled: find("enabled"),
    velocityPoint: find("velocity"),
    positionPoint: find("position"),
    fastest: register("VMAX"),
    positions: axis.positions,
    distances: axis.distances,
    velocities: axis.velocities,
    limits: left !== null && right !== null ? [left, right] : null,
  };
}

export function modelOf(description: Description): Model {
  const controllers = description.controllers.map((part): ControllerModel => {
    const sheet = description.datasheets[part.datasheet] as Datasheet;
    const points = new Map(sheet.points.map((point) => [point.path, point]));
    const mechanicsOf = (number: number) =>
      description.axes.find(({ controller, axis }) => controller === part.name && axis === String(number))?.name ?? "";
    const full = (path: string) => (points.has(path) ? `${part.name}.${path}` : null);
    return {
      name: part.name,
      isReal: part.real,
      noTwin: part.no_twin ? { text: part.no_twin, message: part.messages?.no_twin } : null,
      sheet,
      line: part.line,
      unit: part.unit,
      controls: new Set(part.controls as Control[]),
      axes: sheet.axes.map((axis) => axisModel(part.name, sheet, points, axis, mechanicsOf(axis.number))),
      points,
      status: full("status"),
      program: full("program"),
    };
  });
  nameAxes(controllers);
  return {
    name: description.name,
    controllers,
    lines: description.lines,
    mechanics: description.axes,
    buttons: description.buttons,
    elements: description.elements,
    connections: description.connections,
    scene: description.scene,
    commands: new Set(description.commands),
  };
}

function nameAxes(controllers: readonly ControllerModel[]): void {
  const several = controllers.filter(({ axes }) => axes.length > 1);
  for (const { name, axes } of controllers) {
    for (const axis of axes) {
      const isTaken = several.some((other) => other.name !== name && other.axes.some((one) => one.name === axis.name));
      if (axes.length === 1) axis.label = name;
      else if (isTaken) axis.label = `${name} ${axis.name}`;
    }
  }
}
