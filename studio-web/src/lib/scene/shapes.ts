import { ROUND, unit, type Solid, type Vector } from "./builder";

/** A box, or an upright cylinder, and what it looks like. [mm] */
export interface Shaped {
  size: readonly number[] | null;
  diameter: number | null;
  height: number | null;
  shape?: string | null;
}

/** A solid of a thing, with its middle from that of the thing. */
export type Part = Pick<Solid, "at" | "size" | "prism"> & { color: string | null };

/** Begin and end along the axis, diameters there, all as shares; a place beside the axis; a colour of its own. */
type Section = readonly [
  from: number,
  to: number,
  lower: number,
  upper: number,
  beside?: readonly [number, number],
  color?: string,
];

const DARK = "#2c333a";
const hole = (degrees: number): Section => {
  const angle = (degrees * Math.PI) / 180;
  return [0.4, 0.42, 0.24, 0.24, [0.29 * Math.cos(angle), 0.29 * Math.sin(angle)], DARK];
};

/** What is turned: sections upon each other. */
const SHAPES: Readonly<Record<string, readonly Section[]>> = {
  cylinder: [[0, 1, 1, 1]],
  bottle: [
    [0, 0.55, 1, 1],
    [0.55, 0.74, 1, 0.36],
    [0.74, 0.94, 0.36, 0.36],
    [0.94, 1, 0.44, 0.44],
  ],
  cone: [
    [0, 0.3, 0.06, 1],
    [0.3, 1, 1, 1],
  ],
  funnel: [
    [0, 0.3, 0.15, 0.15],
    [0.3, 0.6, 0.15, 1],
    [0.6, 1, 1, 1],
  ],
  wheel: [
    [0.1, 0.4, 1, 1],
    hole(30),
    hole(150),
    hole(270),
    [0.4, 0.55, 0.22, 0.22],
    [0.4, 1, 0.13, 0.13, [0, 0.42], DARK],
  ],
};

/** The solids of a box, of an upright cylinder, or of what is turned within one: about z, or the side beside two equal ones.
 * `isDown`: what is above is at the lower end. */
export function partsOf(its: Shaped, isDown = false): Part[] {
  const whole = extentOf(its);
  const sections = SHAPES[its.shape ?? (its.size === null ? "cylinder" : "")];
  if (sections === undefined) return [{ at: [0, 0, 0], size: whole, prism: null, color: null }];
  const axis = axisOf(whole);
  const [long, sign] = [whole[axis] as number, isDown ? -1 : 1];
  return sections.map(([from, to, lower, upper, beside = [0, 0], color = null]) => {
    const at = [0, 0, 0];
    const [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
    at[axis] = sign * long * ((from + to) / 2 - 0.5);
    at[a] = beside[0] * (whole[a] as number);
    at[b] = beside[1] * (whole[b] as number);
    const wide = Math.max(lower, upper);
    const size = whole.map((one, k) => one * (k === axis ? to - from : wide)) as unknown as Vector;
    const ends = [lower / wide, upper / wide] as const;
    const prism = { axis, corners: ROUND, towards: unit(axis === 0 ? 1 : 0, 1), ends: isDown ? ([ends[1], ends[0]] as const) : ends }; // prettier-ignore
    return { at: at as unknown as Vector, size, prism, color };
  });
}

/** Along x, y and z; of something that is not there nothing. */
export function extentOf(its: Shaped | undefined): Vector {
  const across = its?.diameter ?? 0;
  return (its?.size as Vector | undefined) ?? [across, across, its?.height ?? 0];
}

export function axisOf([x, y, z]: Vector): number {
  return x === y ? 2 : y === z ? 0 : x === z ? 1 : 2;
}
