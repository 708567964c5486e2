import type { Element, Mechanics, Model } from "../state/model";
import { between, Builder, plain, plus, ROUND, times, unit, type Solid, type Vector } from "./builder";
import { beam, gripper, nest, vacuum } from "./handling";
import type { Scene } from "./poses";

interface Known {
  scene: Scene;
  model: Model;
}

interface Rail {
  low: number;
  high: number;
  width: number;
  carriage: number;
}

/** mm of a rail, from what is known of the travel. */
function railOf(low: number, high: number): Rail {
  const width = between(10, 0.07 * (high - low), 36);
  return { low, high, width, carriage: between(16, 0.18 * (high - low), 90) };
}

const DEFAULT_MM = 200;

/** Where an axis is limited, or at least has switches. [its unit] */
export function travelOf({ travel, switches }: Mechanics, per_unit: number): [number, number] {
  if (travel !== null) return travel as [number, number];
  const ends = switches.flatMap(({ low, high }) => [low, high]).filter((end) => end !== null);
  const room = DEFAULT_MM / 2 / per_unit;
  return [Math.min(-room, ...ends), Math.max(room, ...ends)];
}

/** A profile with stops at its ends and the drive behind one of them; on it a carriage that is as wide as the rail and a half. */
function linear(build: Builder, axis: Mechanics): void {
  const per_unit = build.frame.joints[0]?.per_unit ?? 1;
  const [first, last] = travelOf(axis, per_unit);
  const rail = railOf(first * per_unit, last * per_unit);
  drawRail(build, rail);
  const { low, high, width, carriage } = rail;
  build.rod([low - carriage / 2 - 1.3 * width, 0, 0], 0, 1.6 * width, 1.5 * width, "drive");
  build.box([0, 0, 0], [carriage, 1.7 * width, 1.5 * width], "moving", { isCarried: true });
  switches(axis.switches, per_unit, [low, high], (from, to, pin) => {
    const length = Math.max(to - from, 0.5 * width);
    build.box([(from + to) / 2, -1.15 * width, 0], [length, 0.4 * width, 0.5 * width], "lamp", { pin });
  });
}

function drawRail(build: Builder, { low, high, width, carriage }: Rail): void {
  const [from, to] = [low - carriage / 2, high + carriage / 2];
  build.box([(from + to) / 2, 0, 0], [to - from + 0.6 * width, width, 0.8 * width], "rail");
  for (const end of [from - 0.25 * width, to + 0.25 * width])
    build.box([end, 0, 0], [0.5 * width, 1.9 * width, 1.7 * width], "frame");
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
function reach({ scene }: Known, { frame, axis }: Builder): number {
  const sizes = new Map(
    scene.bodies.map(({ name, size, diameter, height }) => [name, size ?? [diameter ?? 0, diameter ?? 0, height ?? 0]]),
  );
  const far = scene.frames.flatMap(({ name, on, at }) => {
    if (on !== frame.name) return [];
    const size = sizes.get(name) ?? [0, 0, 0];
    const middle = plus(at as unknown as Vector, [0, 0, (size[2] as number) / 2]);
    const across = [0, 1, 2].filter((k) => k !== axis);
    return [
      Math.hypot(...across.map((k) => middle[k] as number)) + Math.max(...across.map((k) => size[k] as number)) / 2,
    ];
  });
  return Math.max(0, ...far);
}

/** A disc on a housing; marks let one see that it turns. */
function turntable(build: Builder, known: Known): void {
  const radius = between(30, 1.1 * reach(known, build) || 70, 1500);
  const thick = between(5, 0.1 * radius, 25);
  // What is on it stands above.
  const down = build.axis === 2 ? -build.sign : -1;
  build.rod([down * thick * 0.5, 0, 0], 0, thick, 2 * radius, "moving", { isCarried: true });
  build.rod([down * (thick + 0.25 * radius), 0, 0], 0, 0.5 * radius, 1.1 * radius, "drive");
  for (let n = 0; n < 4; n++) {
    const [length, width] = [0.35 * radius, 0.06 * radius];
    const out = (n < 2 ? 1 : -1) * 0.78 * radius;
    const at: Vector = n % 2 ? [-down * 0.6, 0, out] : [-down * 0.6, out, 0];
    const size: Vector = n % 2 ? [1.2, width, length] : [1.2, length, width];
    build.box(at, size, n === 0 ? "lamp" : "mark", { isCarried: true });
  }
}

/** A tube, out of which a rod comes with its plate; contacts of its ends are on the tube. */
function cylinder(build: Builder, element: Element): void {
  const stroke = element.drawing?.length || 50;
  const wide = between(14, 0.45 * stroke, 60);
  const tube = stroke + 0.9 * wide;
  build.rod([-tube / 2 - 0.2 * wide, 0, 0], 0, tube, wide, "rail");
  for (const end of [-0.32 * wide, 0.08 * wide - tube]) build.rod([end, 0, 0], 0, 0.28 * wide, 1.18 * wide, "frame");
  build.rod([-stroke / 2 - 0.2 * wide, 0, 0], 0, stroke, 0.36 * wide, "rod", { isCarried: true });
  build.rod([-0.1 * wide, 0, 0], 0, 0.2 * wide, 0.9 * wide, "moving", { isCarried: true });
  const contacts: readonly [string, number][] = [["extended", -0.65 * wide], ["retracted", 0.4 * wide - tube]]; // prettier-ignore
  for (const [name, at] of contacts) {
    if (!element.outputs.includes(name)) continue;
    build.box([at, -0.58 * wide, 0], [0.3 * wide, 0.2 * wide, 0.25 * wide], "lamp", { pin: `${element.name}.${name}` });
  }
  switches(element.drawing?.switches ?? [], 1, [0, stroke], (from, to, pin) =>
    build.box([(from + to) / 2 - stroke - 0.4 * wide, -0.58 * wide, 0], [0.3 * wide, 0.2 * wide, 0.25 * wide], "lamp", {
      pin,
    }),
  );
}

const BELT_MM = 100;

/** A belt about two rollers between its sides. Arrows are lit while it runs. */
function conveyor(build: Builder, element: Element): void {
  const drawing = element.drawing;
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
  const arrows = between(2, Math.round(length / 150), 8);
  const run = element.inputs.includes("run") ? `${element.name}.run` : null;
  for (let n = 0; n < arrows; n++) build.arrow([((n + 0.5) / arrows) * length, 0, 0.2], 0.3 * wide, { pin: run });
  for (const { pin, low } of drawing.switches) {
    const place = low ?? 0;
    if (pin.toLowerCase().startsWith(`${element.name.toLowerCase()}.stop`))
      build.box([place + 2, 0, 0.25 * thick], [4, wide, 0.5 * thick], "lamp", { pin });
    else {
      const high = 0.5 * wide;
      for (const hand of [1, -1])
        build.box([place, hand * (wide / 2 + side + 4), high / 2 - 0.5 * thick], [8, 6, high + 0.2 * thick], "lamp", { pin }); // prettier-ignore
    }
  }
}

/** A beam from its own end to that of the axis that runs beside. */
function gantry(build: Builder, element: Element, { scene }: Known): void {
  const { length, low } = element.drawing ?? { length: DEFAULT_MM, low: 0 };
  const per_unit = build.frame.joints[0]?.per_unit ?? 1;
  const { width } = railOf(low * per_unit, (low + length) * per_unit);
  const beside = scene.frames.find(
    (other) =>
      other.kind === "axis" &&
      other.on === build.frame.on &&
      other.joints[0]?.along === build.frame.joints[0]?.along &&
      Math.hypot(...other.at.map((one, k) => one - (build.frame.at[k] as number))) > 1,
  );
  const from = build.frame.at as unknown as Vector;
  const way =
    beside === undefined ? times(build.across, DEFAULT_MM) : plus(beside.at as unknown as Vector, times(from, -1));
  const across = way.findIndex((one) => Math.abs(one) === Math.max(...way.map(Math.abs)));
  const size = plus(unit(across, Math.abs(way[across] as number)), [1.2 * width, 1.2 * width, 1.2 * width]);
  const at = plus(times(way, 0.5), [0, 0, 1.2 * width]);
  build.put({ ...plain(build), at, size, material: "moving", isCarried: true });
}

/** Two rails beside a plane, a beam between them that goes with y, and a head on the beam. */
function tool(build: Builder, element: Element): void {
  const [x, y] = build.frame.joints;
  const drawing = element.drawing;
  if (x === undefined || y === undefined || drawing === null) return;
  const other = new Builder(build.frame, build.place, build.put, y.along);
  const [wide, high] = [drawing.length * x.per_unit, drawing.across * y.per_unit];
  const [left, bottom] = [drawing.low * x.per_unit, drawing.across_low * y.per_unit];
  const rail = between(8, 0.05 * Math.max(wide, high), 30);
  const middle = times(other.along, bottom + high / 2);
  for (const side of [left - rail, left + wide + rail]) {
    const size = plus(
      unit(other.axis, high + 3 * rail),
      unit(build.axis, rail),
      unit(3 - other.axis - build.axis, rail),
    );
    build.put({ ...plain(build), at: plus(middle, times(build.along, side)), size, material: "rail" });
  }
  const flat = 3 - other.axis - build.axis;
  const beam = plus(unit(build.axis, wide + 3 * rail), unit(other.axis, 1.2 * rail), unit(flat, 0.8 * rail));
  const lift = unit(flat, 0.9 * rail);
  build.put({
    ...plain(build),
    at: plus(times(build.along, left + wide / 2), lift),
    size: beam,
    material: "frame",
    slide: { signal: y.signal, by: times(other.along, y.per_unit) },
  });
  build.put({ ...plain(build), at: lift, size: [2.4 * rail, 2.4 * rail, 2.4 * rail], material: "moving", isCarried: true }); // prettier-ignore
}

/** A rod in its guide, with a roller on what lifts it. */
function follower(build: Builder, element: Element): void {
  const lift = (element.drawing?.length || 20) * (build.frame.joints[0]?.per_unit ?? 1);
  const wide = between(12, 0.4 * lift, 30);
  build.box([0.4 * lift, 0, 0], [wide, 2 * wide, 2 * wide], "rail");
  build.rod([0, 0, 0], 0, 2 * lift + wide, 0.7 * wide, "rod", { isCarried: true });
  build.rod([-lift - wide, 0, 0], 1, 0.6 * wide, 1.2 * wide, "moving", { isCarried: true });
}

function shaft(build: Builder, known: Known): void {
  if (reach(known, build) > 0) return turntable(build, known);
  build.rod([-20, 0, 0], 0, 100, 14, "rod", { isCarried: true });
  // Out of its middle, as a cam is.
  build.rod([0, 8, 0], 0, 14, 60, "moving", { isCarried: true });
  build.box([7.5, 24, 0], [1.2, 16, 6], "lamp", { isCarried: true });
}

/** A second slide on the rail of its axis: where the load is that a spring holds. */
function carriage(build: Builder, element: Element): void {
  const { length, low } = element.drawing ?? { length: DEFAULT_MM, low: 0 };
  const per_unit = build.frame.joints[0]?.per_unit ?? 1;
  const { width, carriage: long } = railOf(low * per_unit, (low + length) * per_unit);
  build.box([0, 0, 0.9 * width], [0.8 * long, 2 * width, 0.5 * width], "moving", { isCarried: true });
}

function body(build: Builder, { scene }: Known): void {
  const its = scene.bodies.find(({ name }) => name === build.frame.name);
  if (its === undefined) return;
  const [diameter, height] = [its.diameter ?? 0, its.height ?? 0];
  const size: Vector = (its.size as unknown as Vector | null) ?? [diameter, diameter, height];
  const prism = its.size === null ? { axis: 2, corners: ROUND, towards: [1, 0, 0] as Vector } : null;
  build.put({
    ...plain(build),
    at: [0, 0, size[2] / 2],
    size,
    prism,
    material: its.lit === null ? "frame" : "glass",
    color: its.color,
    shown: its.when === null ? null : `${its.name}.present`,
    pin: its.lit === null ? null : `${its.name}.lit`,
  });
}

/** All solids of a scene: what elements are drawn with, by their kinds. */
export function solidsOf(scene: Scene, model: Model): Solid[] {
  const solids: Solid[] = [];
  const known = { scene, model };
  scene.frames.forEach((frame, place) => {
    const build = new Builder(frame, place, (solid) => solids.push(solid));
    const element = model.elements.find(({ name }) => name === frame.name);
    const axis = model.mechanics.find(({ name }) => name === frame.name);
    if (axis !== undefined) {
      if (axis.kind === "rotary") turntable(build, known);
      else linear(build, axis);
    } else if (frame.kind === "body") body(build, known);
    else if (element === undefined) return;
    else if (frame.kind === "cylinder") cylinder(build, element);
    else if (frame.kind === "conveyor") conveyor(build, element);
    else if (frame.kind === "gantry") gantry(build, element, known);
    else if (frame.kind === "tool") tool(build, element);
    else if (frame.kind === "follower") follower(build, element);
    else if (frame.kind === "shaft") shaft(build, known);
    else if (frame.kind === "carriage") carriage(build, element);
    else if (frame.kind === "vacuum") vacuum(build, scene);
    else if (frame.kind === "gripper") gripper(build, element);
    else if (frame.kind === "nest") nest(build, scene);
    else if (frame.kind === "beam") beam(build, scene);
  });
  return solids;
}
