import type { Element, Mechanics, Model } from "../state/model";
import { between, Builder, plus, times, unit, type Solid, type Vector } from "./builder";
import { beam, gripper, nest, vacuum } from "./handling";
import { directionOf, type Scene } from "./poses";
import { axisOf, extentOf, partsOf } from "./shapes";

/** What there is besides an element, and what it is besides its frame. */
interface Known {
  scene: Scene;
  axis: Mechanics | undefined;
  element: Element | undefined;
}

interface Rail {
  low: number;
  high: number;
  width: number;
  carriage: number;
}

const DEFAULT_MM = 200;
const perUnit = ({ frame }: Builder) => frame.joints[0]?.per_unit ?? 1;

/** mm of a rail, from what is known of the travel. */
function railBetween(low: number, high: number): Rail {
  const width = between(10, 0.07 * (high - low), 36);
  return { low, high, width, carriage: between(16, 0.18 * (high - low), 90) };
}

/** The rail of what has a track, such as a gantry. */
function railAlong(build: Builder, element: Element | undefined): Rail {
  const { length, low } = element?.drawing ?? { length: DEFAULT_MM, low: 0 };
  return railBetween(low * perUnit(build), (low + length) * perUnit(build));
}

export function railOf(build: Builder, axis: Mechanics): Rail {
  const [low, high] = travelOf(axis, perUnit(build));
  return railBetween(low * perUnit(build), high * perUnit(build));
}

/** Where an axis is limited, or at least has switches. [its unit] */
export function travelOf({ travel, switches }: Mechanics, per_unit: number): [number, number] {
  if (travel !== null) return travel as [number, number];
  const ends = switches.flatMap(({ low, high }) => [low, high]).filter((end) => end !== null);
  const room = DEFAULT_MM / 2 / per_unit;
  return [Math.min(-room, ...ends), Math.max(room, ...ends)];
}

/** More in a revolution is a belt about pulleys, less is a screw. [mm] */
const SCREW_MM = 30;

/** A profile with stops at its ends and the drive behind one of them; on it a carriage that is as wide as the rail and a half. Its
 * groove shows the screw, or the belt with its pulley. */
function linear(build: Builder, axis: Mechanics): void {
  const { low, high, width, carriage } = railOf(build, axis);
  const [from, to] = [low - carriage / 2, high + carriage / 2];
  const [middle, long] = [(from + to) / 2, to - from + 0.6 * width];
  if (!axis.pitch) build.box([middle, 0, 0], [long, width, 0.8 * width], "rail");
  else {
    build.box([middle, 0, -0.15 * width], [long, width, 0.5 * width], "rail");
    for (const side of [0.39, -0.39])
      build.box([middle, side * width, 0.25 * width], [long, 0.22 * width, 0.3 * width], "rail");
    if (axis.pitch <= SCREW_MM) build.rod([middle, 0, 0.25 * width], 0, long, 0.28 * width, "drive");
    else {
      build.box([middle, 0, 0.2 * width], [long, 0.4 * width, 0.1 * width], "belt");
      build.rod([to + 0.9 * width, 0, 0.1 * width], 1, 0.7 * width, 0.8 * width, "belt");
    }
  }
  for (const end of [from - 0.25 * width, to + 0.25 * width])
    build.box([end, 0, 0], [0.5 * width, 1.9 * width, 1.7 * width], "frame");
  drive(build, axis, from, -1.6 * width, 1.5 * width);
  build.box([0, 0, 0], [carriage, 1.7 * width, 1.5 * width], "moving", { isCarried: true });
  switches(axis.switches, perUnit(build), [low, high], (begin, end, pin) => {
    const length = Math.max(end - begin, 0.5 * width);
    build.box([(begin + end) / 2, -1.15 * width, 0], [length, 0.4 * width, 0.5 * width], "lamp", { pin });
  });
}

/** A motor from a place on: its body, and a round lid behind it. */
function motor(build: Builder, from: number, length: number, wide: number): void {
  build.box([from + 0.42 * length, 0, 0], [0.84 * Math.abs(length), 0.9 * wide, 0.9 * wide], "drive");
  build.rod([from + 0.92 * length, 0, 0], 0, 0.16 * Math.abs(length), 0.75 * wide, "drive");
}

/** A motor with its brake behind it: a disc between two shoes, which are lit while they let go. */
function drive(build: Builder, { brake }: Mechanics, from: number, length: number, wide: number): void {
  motor(build, from, length, wide);
  if (brake === null) return;
  const [at, thick] = [from + 1.1 * length, Math.max(4, 0.1 * Math.abs(length))];
  build.rod([at, 0, 0], 0, thick, 0.9 * wide, "rod", { element: brake });
  const shoe = { element: brake, pin: `${brake}.released` };
  for (const side of [-0.45, 0.45])
    build.box([at, side * wide, 0], [2.5 * thick, 0.3 * wide, 0.6 * wide], "lamp", shoe);
}

/** Where switches are on, within the travel. */
function switches(
  all: Mechanics["switches"],
  per_unit: number,
  [low, high]: readonly [number, number],
  put: (from: number, to: number, pin: string) => void,
): void {
  const MOST = 50;
  const inside = (mm: number) => between(low, mm, high);
  for (const { pin, low: from, high: to, period } of all) {
    const [begin, end] = [(from ?? -Infinity) * per_unit, (to ?? Infinity) * per_unit];
    const step = (period ?? 0) * per_unit;
    const first = step > 0 ? Math.ceil((low - end) / step) : 0;
    const count = step > 0 ? Math.min(MOST, Math.floor((high - begin) / step) - first + 1) : 1;
    for (let n = first; n < first + count; n++) put(inside(begin + n * step), inside(end + n * step), pin);
  }
}

/** How far from the axis about which a frame turns something is carried on it. */
function reach(scene: Scene, { frame, axis }: Builder): number {
  const across = [0, 1, 2].filter((k) => k !== axis);
  const far = scene.frames.flatMap(({ name, on, at }) => {
    if (on !== frame.name) return [];
    const body = scene.bodies.find((one) => one.name === name);
    const size = extentOf(body);
    const middle = plus(at as unknown as Vector, [0, 0, size[2] / 2]);
    return [
      Math.hypot(...across.map((k) => middle[k] as number)) + Math.max(...across.map((k) => size[k] as number)) / 2,
    ];
  });
  return Math.max(0, ...far);
}

/** A disc on its motor, or on a bare shaft; what turns about a line that lies has a hub. Marks let one see that it turns. Switches are
 * at the rim. */
function turntable(build: Builder, { scene, axis, element }: Known): void {
  const far = reach(scene, build);
  const isTable = build.axis === 2;
  const isDriven = axis !== undefined || element?.kind === "dcmotor";
  const radius = isTable ? between(30, 1.1 * far || 70, 1500) : between(12, (isDriven ? 1 : 0.3) * far || 30, 300);
  const thick = between(5, 0.1 * radius, 25);
  // What is on it stands above.
  const down = isTable ? -build.sign : -1;
  build.rod([down * thick * 0.5, 0, 0], 0, thick, 2 * radius, "moving", { isCarried: true });
  const [from, long, wide] = [down * thick, down * (isTable ? 0.5 : 1.6) * radius, (isTable ? 0.8 : 1.5) * radius];
  if (axis !== undefined) drive(build, axis, from, long, wide);
  else if (element?.kind === "dcmotor") motor(build, from, long, wide);
  else build.rod([from + down * 0.3 * radius, 0, 0], 0, 0.6 * radius, 0.25 * radius, "rod");
  for (let n = 0; n < 4; n++) {
    const [length, width] = [0.35 * radius, 0.06 * radius];
    const out = (n < 2 ? 1 : -1) * 0.78 * radius;
    const at: Vector = n % 2 ? [-down * 0.6, 0, out] : [-down * 0.6, out, 0];
    const size: Vector = n % 2 ? [1.2, width, length] : [1.2, length, width];
    build.box(at, size, n === 0 ? "lamp" : "mark", { isCarried: true });
  }
  axis?.switches.forEach(({ pin }, n) =>
    build.box([down * thick * 0.5, radius + thick, n * 2.5 * thick], [thick, 1.6 * thick, 2 * thick], "lamp", { pin }),
  );
}

/** A tube, out of which a rod comes with its plate; contacts of its ends are on the tube. */
function cylinder(build: Builder, { name, outputs, drawing }: Element): void {
  const stroke = drawing?.length || 50;
  const wide = between(8, 0.25 * stroke, 50);
  const tube = stroke + 0.9 * wide;
  build.rod([-tube / 2 - 0.2 * wide, 0, 0], 0, tube, wide, "rail");
  for (const end of [-0.32 * wide, 0.08 * wide - tube]) build.rod([end, 0, 0], 0, 0.28 * wide, 1.18 * wide, "frame");
  build.rod([-stroke / 2 - 0.2 * wide, 0, 0], 0, stroke, 0.36 * wide, "rod", { isCarried: true });
  build.rod([-0.1 * wide, 0, 0], 0, 0.2 * wide, 0.9 * wide, "moving", { isCarried: true });
  const contact = (at: number, pin: string) =>
    build.box([at, -0.58 * wide, 0], [0.3 * wide, 0.2 * wide, 0.25 * wide], "lamp", { pin });
  if (outputs.includes("extended")) contact(-0.65 * wide, `${name}.extended`);
  if (outputs.includes("retracted")) contact(0.4 * wide - tube, `${name}.retracted`);
  switches(drawing?.switches ?? [], 1, [0, stroke], (from, to, pin) =>
    contact((from + to) / 2 - stroke - 0.4 * wide, pin),
  );
}

const BELT_MM = 100;

/** A belt about two rollers between its sides, and a plate before it where workpieces come. Arrows are lit while it runs. */
function conveyor(build: Builder, { name, inputs, drawing }: Element): void {
  if (drawing === null) return;
  const { length } = drawing;
  const wide = drawing.across || BELT_MM;
  const thick = between(12, 0.06 * length, 40);
  const side = between(3, 0.06 * wide, 8);
  build.box([length / 2, 0, -thick / 2], [length - thick, wide, thick - 1], "belt");
  for (const end of [thick / 2, length - thick / 2]) build.rod([end, 0, -thick / 2], 1, wide, thick, "belt");
  for (const hand of [1, -1])
    build.box(
      [length / 2, (hand * (wide + side)) / 2, -0.55 * thick],
      [length - 0.6 * thick, side, 0.8 * thick],
      "rail",
    );
  if (drawing.feeds) build.box([-drawing.size / 2, 0, -0.2 * thick], [drawing.size, wide, 0.4 * thick], "frame");
  const arrows = between(2, Math.round(length / 150), 8);
  const run = inputs.includes("run") ? `${name}.run` : null;
  for (let n = 0; n < arrows; n++) build.arrow([((n + 0.5) / arrows) * length, 0, 0.2], 0.3 * wide, { pin: run });
  for (const { pin, low } of drawing.switches) {
    const place = low ?? 0;
    if (pin.toLowerCase().startsWith(`${name.toLowerCase()}.stop`))
      build.box([place + 2, 0, 0.25 * thick], [4, wide, 0.5 * thick], "lamp", { pin });
    else {
      const high = 0.5 * wide;
      for (const hand of [1, -1])
        build.box([place, hand * (wide / 2 + side + 4), high / 2 - 0.5 * thick], [8, 6, high + 0.2 * thick], "lamp", { pin }); // prettier-ignore
    }
  }
}

/** A beam from its own end to that of the axis that runs beside. */
function gantry(build: Builder, { scene, element }: Known): void {
  const { width } = railAlong(build, element);
  const { frame } = build;
  const beside = scene.frames.find(
    (other) =>
      other.kind === "axis" &&
      other.on === frame.on &&
      other.joints[0]?.along === frame.joints[0]?.along &&
      Math.hypot(...other.at.map((one, k) => one - (frame.at[k] as number))) > 1,
  );
  const from = times(frame.at as unknown as Vector, -1);
  const way = beside === undefined ? times(build.across, DEFAULT_MM) : plus(beside.at as unknown as Vector, from);
  const across = way.findIndex((one) => Math.abs(one) === Math.max(...way.map(Math.abs)));
  const size = plus(unit(across, Math.abs(way[across] as number)), [1.2 * width, 1.2 * width, 1.2 * width]);
  build.add(plus(times(way, 0.5), [0, 0, 1.2 * width]), size, "moving", { isCarried: true });
}

/** Two rails beside a plane, a beam between them that goes with y, and a head on the beam. Its two motors are at corners; their belts go
 * along the rails and the beam. */
function tool(build: Builder, { drawing }: Element): void {
  const [x, y] = build.frame.joints;
  if (x === undefined || y === undefined || drawing === null) return;
  const other = new Builder(build.frame, build.place, build.put, y.along);
  const flat = 3 - other.axis - build.axis;
  const sized = (wide: number, high: number, thick: number) =>
    plus(unit(build.axis, wide), unit(other.axis, high), unit(flat, thick));
  const [wide, high] = [drawing.length * x.per_unit, drawing.across * y.per_unit];
  const [left, bottom] = [drawing.low * x.per_unit, drawing.across_low * y.per_unit];
  const rail = between(8, 0.05 * Math.max(wide, high), 30);
  const middle = times(other.along, bottom + high / 2);
  for (const side of [left - rail, left + wide + rail])
    build.add(plus(middle, times(build.along, side)), sized(rail, high + 3 * rail, rail), "rail");
  const lift = unit(flat, 0.9 * rail);
  const slide = { signal: y.signal, by: times(other.along, y.per_unit) };
  const beam = plus(times(build.along, left + wide / 2), lift);
  build.add(beam, sized(wide + 3 * rail, 1.2 * rail, 0.8 * rail), "frame", { slide });
  build.add(lift, [2.4 * rail, 2.4 * rail, 2.4 * rail], "moving", { isCarried: true });
  const belt = plus(beam, unit(flat, 0.5 * rail));
  for (const hand of [1, -1]) {
    const beside = times(other.along, 0.35 * hand * rail);
    build.add(plus(belt, beside), sized(wide + 2 * rail, 0.15 * rail, 0.3 * rail), "belt", { slide });
    const side = times(build.along, left + wide / 2 + hand * (wide / 2 + rail));
    build.add(plus(middle, side, unit(flat, 0.6 * rail)), sized(0.3 * rail, high + 2 * rail, 0.15 * rail), "belt");
    const corner = plus(side, times(other.along, bottom + high + 2.4 * rail));
    build.add(corner, sized(1.8 * rail, 1.8 * rail, 2 * rail), "drive");
  }
}

/** A rod in its guide, with a roller on what lifts it; it ends where what is on it stands. */
function follower(build: Builder, { drawing }: Element): void {
  const lift = (drawing?.length || 20) * perUnit(build);
  const wide = between(12, 0.4 * lift, 30);
  const long = lift + wide;
  build.box([-wide / 2, 0, 0], [wide, 2 * wide, 2 * wide], "rail");
  build.rod([-long / 2, 0, 0], 0, long, 0.7 * wide, "rod", { isCarried: true });
  build.rod([-long, 0, 0], 1, 0.6 * wide, 1.2 * wide, "moving", { isCarried: true });
}

function shaft(build: Builder, known: Known): void {
  if (reach(known.scene, build) > 0) return turntable(build, known);
  build.rod([-20, 0, 0], 0, 100, 14, "rod", { isCarried: true });
  // Out of its middle, as a cam is.
  build.rod([0, 8, 0], 0, 14, 60, "moving", { isCarried: true });
  build.box([7.5, 24, 0], [1.2, 16, 6], "lamp", { isCarried: true });
}

/** A second slide on the rail of its axis: where the load is that a spring holds. */
function carriage(build: Builder, { element }: Known): void {
  const { width, carriage: long } = railAlong(build, element);
  build.box([0, 0, 0.9 * width], [0.8 * long, 2 * width, 0.5 * width], "moving", { isCarried: true });
}

/** What lies on something that turns shows where that does, and else who looks. */
function isDown(build: Builder, { frames }: Scene, axis: number): boolean {
  const turning = frames.find(({ name }) => name === build.frame.on)?.joints.find(({ turns }) => turns);
  const [about, sign] = directionOf(turning?.along ?? "+z");
  return axis !== 2 && (about !== axis || sign < 0);
}

function body(build: Builder, { scene }: Known): void {
  const its = scene.bodies.find(({ name }) => name === build.frame.name);
  if (its === undefined) return;
  const size = extentOf(its);
  const { when, lit, draws, draws_on, line_to, color } = its;
  const shown = when === null ? null : `${its.name}.present`;
  const pin = lit === null ? null : `${its.name}.lit`;
  for (const part of partsOf(its, isDown(build, scene, axisOf(size))))
    build.add(plus(part.at, [0, 0, size[2] / 2]), part.size, lit === null ? "frame" : "glass", {
      ...{ prism: part.prism, color: part.color ?? color, shown, pin },
    });
  const line = (at: Vector, signal: string | null, to: string | null, end: Vector | null) =>
    build.add(at, [0, 0, 0], "line", {
      color: signal === null ? null : color,
      line: { signal, on: scene.frames.findIndex(({ name }) => name === to), end },
    });
  if (draws) line([0, 0, 0], `${its.name}.draws`, draws_on, null);
  if (line_to) line([0, 0, size[2] / 2], null, line_to, [0, 0, extentOf(scene.bodies.find(({ name }) => name === line_to))[2] / 2]); // prettier-ignore
}

type Draw = (build: Builder, known: Known) => void;
const withElement =
  (draw: (build: Builder, element: Element) => void): Draw =>
  (build, { element }) =>
    element && draw(build, element);

/** What elements are drawn with, by their kinds. */
const KINDS: Readonly<Record<string, Draw>> = {
  dcmotor: turntable,
  axis: (build, known) =>
    known.axis?.kind === "rotary" ? turntable(build, known) : known.axis && linear(build, known.axis),
  cylinder: withElement(cylinder),
  conveyor: withElement(conveyor),
  tool: withElement(tool),
  follower: withElement(follower),
  gripper: withElement(gripper),
  vacuum: (build, { scene }) => vacuum(build, scene),
  nest: (build, { scene }) => nest(build, scene),
  beam: (build, { scene }) => beam(build, scene),
  ...{ gantry, shaft, carriage, body },
};

/** All solids of a scene. */
export function solidsOf(scene: Scene, model: Model): Solid[] {
  const solids: Solid[] = [];
  scene.frames.forEach((frame, place) => {
    const axis = model.mechanics.find(({ name }) => name === frame.name);
    const element = model.elements.find(({ name }) => name === frame.name);
    KINDS[frame.kind]?.(new Builder(frame, place, (solid) => solids.push(solid)), { scene, axis, element });
  });
  return solids;
}
