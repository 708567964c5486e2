import { meaningOf } from "../../text";
import type { Datasheet, Point } from "../../lib/state/model";

/** How addresses are written: counted from 0 as the manuals do, from 1 as many masters do, or with the number of their space. */
export type Base = "base0" | "base1" | "modicon";
export const BASES: readonly Base[] = ["base0", "base1", "modicon"];

/** The first digit of an address by its space, as Modicon wrote them. */
const SPACES: Readonly<Record<string, string>> = { coil: "0", input: "1", "holding register": "4" };

export interface Row {
  /** As the point is named after its controller. */
  path: string;
  point: Point;
  /** `M1`, `user` for user registers, empty for the controller as a whole. */
  group: string;
}

/** A point with more words than a value takes is a block: user registers, each of which can be read as several types. */
export const isBlock = (point: Point): boolean => (point.addresses[0]?.words ?? 0) > 2;

export function groupOf(path: string, sheet: Datasheet): string {
  return sheet.axes.find(({ name }) => path.startsWith(`${name}.`) || path.startsWith(`${name}_`))?.name ?? "";
}

/** Every point but blocks. */
export function rowsOf(sheet: Datasheet): Row[] {
  return sheet.points
    .filter((point) => !isBlock(point))
    .map((point) => ({ path: point.path, point, group: groupOf(point.path, sheet) }));
}

/** Registers of a block from `first` on, as `WORD`, `INT`, `DINT` or `REAL`; two words make a DINT or a REAL. */
export function blockRows(point: Point, first: number, type: string, most: number): Row[] {
  const [address] = point.addresses;
  if (address === undefined || typeof address.place !== "number") return [];
  const start = address.place;
  const words = type === "DINT" || type === "REAL" ? 2 : 1;
  const from = first - (first % words);
  const suffix = type === "WORD" ? "" : `:${type.toLowerCase()}`;
  const found: Row[] = [];
  for (let index = from; index + words <= address.words && found.length < most; index += words) {
    const own: Point = {
      ...point,
      path: `${point.path}[${index}]${suffix}`,
      addresses: [{ ...address, place: start + index, words, type }],
      limits: LIMITS[type] ?? null,
    };
    found.push({ path: own.path, point: own, group: "user" });
  }
  return found;
}

const LIMITS: Readonly<Record<string, NonNullable<Point["limits"]>>> = {
  WORD: { low: 0, high: 65535, is_low_excluded: false },
  INT: { low: -32768, high: 32767, is_low_excluded: false },
  DINT: { low: -2147483648, high: 2147483647, is_low_excluded: false },
  REAL: { low: null, high: null, is_low_excluded: false },
};

export function shownAddress(point: Point, base: Base): string {
  return point.addresses
    .map(({ space, place }) => {
      if (typeof place === "string") return place;
      if (base === "base0") return String(place);
      const number = place + 1;
      if (base === "base1") return String(number);
      return (SPACES[space] ?? "") + String(number).padStart(number > 9999 ? 5 : 4, "0");
    })
    .join(" ");
}

/** Whether a row is meant by what was typed: a part of its name or meaning, or its address in any form. */
export function isMeant({ path, point }: Row, typed: string): boolean {
  const wanted = typed.trim().toLowerCase();
  if (!wanted) return true;
  if (
    path.toLowerCase().includes(wanted) ||
    [point.meaning, meaningOf("points", point.path, point.meaning)].some((meaning) =>
      meaning.toLowerCase().includes(wanted),
    )
  )
    return true;
  return BASES.some((base) => shownAddress(point, base).toLowerCase().split(" ").includes(wanted));
}

/** A switch that cannot be read: writing 1 is all there is to it. */
export const isTrigger = (point: Point): boolean =>
  point.access === "w" && point.type === "switch" && point.effect === "acts";
