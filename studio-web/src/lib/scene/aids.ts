import type { Mechanics, Model } from "../state/model";
import { Builder, plus, times, type Aid, type Material, type Solid, type Vector } from "./builder";
import { directionOf, type Scene } from "./poses";
import { railOf, travelOf } from "./solids";

export const isAid = ({ material }: { material: Material }): boolean => AIDS.has(material);
const AIDS: ReadonlySet<Material> = new Set<Aid>(["ghost", "travel", "workspace"]);
const TRACES = 8;

/** What is shown of a machine besides itself. `tips`: frames of what works on workpieces. */
export function aidsOf(scene: Scene, model: Model, solids: readonly Solid[], tips: readonly number[]): Solid[] {
  const found: Solid[] = [];
  for (const one of solids)
    if (
      one.line === undefined &&
      tips.includes(one.frame) &&
      (one.isCarried || scene.frames[one.frame]?.joints.length === 0)
    )
      found.push({ ...one, material: "ghost", color: null, pin: null, shown: null });
  const put = (solid: Solid) => found.push(solid);
  model.mechanics.forEach((axis, n) => {
    const place = scene.frames.findIndex(({ name }) => name === axis.name);
    const frame = scene.frames[place];
    if (frame?.joints[0]?.turns === false)
      travel(new Builder(frame, place, put), axis, softLimits(model, axis), `--trace-${1 + (n % TRACES)}`);
  });
  for (const tip of tips) {
    workspace(scene, model, tip, put);
    const { name } = scene.frames[tip] as Scene["frames"][number];
    new Builder(scene.frames[tip] as Scene["frames"][number], tip, put).add([0, 0, 0], [0, 0, 0], "line", {
      ...{ element: name, color: "--trace-6", line: { signal: null, on: -1, end: null } },
    });
  }
  return found;
}

/** Registers with the soft limits of an axis, in the count of its controller. */
export function softLimits({ controllers }: Model, { controller, axis }: Mechanics): readonly string[] {
  const drive = controllers.find(({ name }) => name === controller);
  return drive?.axes.find(({ number }) => String(number) === axis)?.limits ?? [];
}

/** A bar beside the rail, from one hard stop to the other, with plates at the soft limits and a pointer at the carriage. */
function travel(build: Builder, axis: Mechanics, limits: readonly string[], color: string): void {
  const { low, high, width } = railOf(build, axis);
  const mark = (at: number, length: number, wide: number, look: Partial<Solid> = {}) =>
    build.box([at, 1.4 * width, 0], [length, wide, wide], "travel", { color, ...look });
  if (axis.travel !== null) {
    mark((low + high) / 2, high - low, 0.25 * width);
    for (const end of [low, high]) mark(end, 0.15 * width, 0.8 * width);
  }
  mark(0, 0.3 * width, 0.6 * width, { isCarried: true });
  const by = times(build.along, build.frame.joints[0]?.per_unit ?? 1);
  for (const signal of limits) mark(0, 0.15 * width, 1.5 * width, { slide: { signal, by } });
}

/** The box in which a tip can be, where the ends of all that moves it are known and nothing turns it. */
function workspace(scene: Scene, model: Model, tip: number, put: (solid: Solid) => void): void {
  const ranges = rangesOf(scene, model);
  let [low, high]: [Vector, Vector] = [
    [0, 0, 0],
    [0, 0, 0],
  ];
  for (let place = tip; ;) {
    const frame = scene.frames[place] as Scene["frames"][number];
    if (model.mechanics.some(({ name, travel }) => name === frame.name && travel === null)) return;
    for (const { signal, along, turns, per_unit } of frame.joints) {
      const range = ranges.get(signal);
      if (turns || range === undefined) return;
      const [axis, sign] = directionOf(along);
      const ends = range.map((end) => end * sign * per_unit);
      const moved = (to: number) => [0, 1, 2].map((k) => (k === axis ? to : 0)) as unknown as Vector;
      low = plus(low, moved(Math.min(...ends)));
      high = plus(high, moved(Math.max(...ends)));
    }
    const on = scene.frames.findIndex(({ name }) => name === frame.on);
    if (on < 0) {
      const size = plus(high, times(low, -1)).map((one) => Math.max(one, 1)) as unknown as Vector;
      const element = scene.frames[tip]?.name ?? "";
      return new Builder(frame, place, put).add(times(plus(low, high), 0.5), size, "workspace", { element });
    }
    low = plus(low, frame.at as unknown as Vector);
    high = plus(high, frame.at as unknown as Vector);
    place = on;
  }
}

/** Where signals of motion may be, in their units. */
export function rangesOf({ frames }: Scene, model: Model): Map<string, readonly [number, number]> {
  const found = new Map<string, readonly [number, number]>();
  for (const { joints } of frames)
    for (const { signal, turns, per_unit } of joints) if (turns) found.set(signal, [0, 360 / per_unit]);
  for (const axis of model.mechanics) {
    const joint = frames.find(({ name }) => name === axis.name)?.joints[0];
    if (joint !== undefined && !joint.turns) found.set(joint.signal, travelOf(axis, joint.per_unit));
  }
  for (const { name, drawing } of model.elements) {
    if (drawing === null || drawing.shape === "dial") continue;
    const { low, length, across_low, across, shape, places } = drawing;
    places.forEach((place, k) =>
      found.set(
        `${name}.${place}`,
        shape === "plane" && k === 1 ? [across_low, across_low + across] : [low, low + length],
      ),
    );
  }
  return found;
}
