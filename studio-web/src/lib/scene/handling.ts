import type { Element } from "../state/model";
import { between, Builder, plus, times, unit, type Vector } from "./builder";
import { directionOf, type Scene } from "./poses";
import { extentOf } from "./shapes";

/** What takes workpieces, holds them and sees them. */

const named = <T extends { name: string }>(list: readonly T[], build: Builder) =>
  list.find(({ name }) => name === build.frame.name);

/** Folds of rubber below a nozzle, with the lip at the origin; a ring is lit while the cup holds. */
export function vacuum(build: Builder, { cups }: Scene): void {
  const diameter = Math.max(1, named(cups, build)?.diameter ?? 0);
  const high = between(4, 0.35 * diameter, 20);
  const disc = (from: number, to: number, wide: number) =>
    build.rod([0, 0, ((from + to) / 2) * high], 2, (to - from) * high, wide * diameter, "belt", { isCarried: true });
  disc(0, 0.3, 1);
  disc(0.3, 0.45, 0.7);
  disc(0.45, 0.75, 0.9);
  const ring = { pin: `${build.frame.name}.held`, isCarried: true };
  build.rod([0, 0, 0.9 * high], 2, 0.3 * high, 0.7 * diameter, "lamp", ring);
  build.rod([0, 0, 1.05 * high + 0.3 * diameter], 2, 0.6 * diameter, 0.4 * diameter, "rod", { isCarried: true });
}

/** Two jaws below their drive, each with its face half of the way from the middle, and their tips at the origin. */
export function gripper(build: Builder, element: Element): void {
  const stroke = element.drawing?.length || 20;
  const thick = between(2, 0.25 * stroke, 16);
  const [long, wide] = [between(10, 1.2 * stroke, 70), between(5, 0.6 * stroke, 30)];
  build.box([0, 0, long + thick], [stroke + 3 * thick, 1.4 * wide, 2 * thick], "drive");
  for (const side of [1, -1])
    build.box([side * (stroke / 2 + thick / 2), 0, long / 2], [thick, wide, long], "moving", {
      slide: { signal: `${element.name}.position`, by: times(build.along, -side / 2) },
    });
  build.box([0, -0.7 * wide - 1, long + thick], [thick, 2, thick], "lamp", { pin: `${element.name}.held` });
}

const MOST_LINES = 40;
/** Lines are so high that they are seen on what carries them, and are below workpieces. */
const LINE_MM = 0.01;

/** Lines that part the cells, on a plate where they are not on the top face of a body or a turntable. */
export function nest(build: Builder, { nests, bodies, frames }: Scene): void {
  const its = named(nests, build);
  if (its === undefined) return;
  const bounds = [0, 1].map((k): [number, number, number] => {
    const [count, pitch, cell] = [its.cells[k] as number, its.pitch[k] as number, its.cell[k] as number];
    return [-cell / 2, (count - 1) * pitch + cell / 2, between(0.6, 0.04 * cell, 3)];
  }) as [[number, number, number], [number, number, number]];
  const middle = bounds.map(([low, high]) => (low + high) / 2) as [number, number];
  const size = bounds.map(([low, high]) => high - low) as [number, number];
  const thick = between(3, 0.05 * Math.min(...size), 15);
  const rim = 0.4 * thick;
  const { on, at } = build.frame;
  const body = bodies.find(({ name }) => name === on);
  const isTurned = frames.some(({ name, joints }) => name === on && joints.some(({ turns }) => turns));
  if ((body === undefined && !isTurned) || (at[2] as number) > extentOf(body)[2])
    build.box([middle[0], middle[1], -thick / 2], [size[0] + 2 * rim, size[1] + 2 * rim, thick], "rail");
  if ((its.cells[0] as number) + (its.cells[1] as number) > MOST_LINES) return;
  bounds.forEach(([low, high, line], k) => {
    const count = its.cells[k] as number;
    for (let n = 0; n <= count; n++) {
      const at = n === 0 ? low : n === count ? high : (n - 0.5) * (its.pitch[k] as number);
      const [place, extent]: [Vector, Vector] =
        k === 0
          ? [[at, middle[1], LINE_MM / 2], [line, size[1], LINE_MM]]
          : [[middle[0], at, LINE_MM / 2], [size[0], line, LINE_MM]]; // prettier-ignore
      build.box(place, extent, "mark");
    }
  });
}

/** Up to here it is drawn as a proximity switch. */
const NEAR_MM = 50;
const LIGHT_MM = 1;

/** Lines of light between a sender and a receiver, or before a proximity switch. */
export function beam(build: Builder, { beams }: Scene): void {
  const its = named(beams, build);
  if (its === undefined) return;
  const { length, count, pitch } = its;
  const [axis, sign] = directionOf(its.across);
  const pin = `${its.name}.seen`;
  const across = unit(axis, sign);
  const [high, wide] = [(count - 1) * pitch, between(8, 0.03 * length, 24)];
  if (count === 1 && length <= NEAR_MM) {
    build.rod([-20, 0, 0], 0, 36, 12, "rod");
    build.rod([-1, 0, 0], 0, 2, 10, "lamp", { pin });
  } else {
    const middle = times(across, high / 2);
    const post = plus([wide, wide, wide], times(unit(axis, 1), high));
    for (const along of [-wide / 2, length + wide / 2])
      build.add(plus(times(build.along, along), middle), post, "drive");
    const lamp = plus(times(build.along, -wide / 2), times(across, high + wide / 2 + 1));
    build.add(lamp, [0.6 * wide, 0.6 * wide, 0.6 * wide], "lamp", { pin });
  }
  const light = plus([LIGHT_MM, LIGHT_MM, LIGHT_MM], unit(build.axis, length - LIGHT_MM));
  const step = Math.ceil(count / MOST_LINES);
  for (let n = 0; n < count; n += step)
    build.add(plus(times(build.along, length / 2), times(across, n * pitch)), light, "light", { pin });
}
