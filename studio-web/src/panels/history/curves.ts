import type { Requests } from "../../lib/protocol/types";

export type Series = Requests["history_values"]["answer"]["series"][number];
export type Span = readonly [number, number];

/** Of a text: from when to when it holds. */
export interface Interval {
  from: number;
  to: number;
  text: string;
}

/** The least and the greatest number, with room; null where there is none. */
export function rangeOf(all: readonly Series[]): Span | null {
  let low = Infinity;
  let high = -Infinity;
  for (const { values } of all)
    for (const value of values) {
      if (typeof value !== "number") continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  if (low > high) return null;
  const room = high > low ? (high - low) * 0.06 : Math.max(Math.abs(high) * 0.06, 0.5);
  return [low - room, high + room];
}

/**
 * The points of polylines in a box. Values of a motion are joined; others hold until the next one, the last one until `end_s`, the
 * end of the run or interval. A line ends where a value is not known.
 */
export function linesOf(
  series: Series,
  time: Span,
  end_s: number,
  range: Span,
  width: number,
  height: number,
): string[] {
  const x = (at: number) => (((at - time[0]) / (time[1] - time[0] || 1)) * width).toFixed(1);
  const y = (value: number) => (height - ((value - range[0]) / (range[1] - range[0])) * height).toFixed(1);
  const lines: string[] = [];
  let line: string[] = [];
  const finish = () => {
    if (line.length) lines.push(line.join(" "));
    line = [];
  };
  series.at_s.forEach((at, index) => {
    const value = series.values[index];
    if (typeof value !== "number") return finish();
    line.push(`${x(at)},${y(value)}`);
    const next = series.at_s[index + 1];
    if (!series.is_motion || next === undefined) line.push(`${x(Math.min(next ?? end_s, time[1]))},${y(value)}`);
  });
  finish();
  return lines;
}

/** When each text holds, in order; what is not known is left out. */
export function intervalsOf(series: Series, end_s: number): Interval[] {
  const found: Interval[] = [];
  series.at_s.forEach((from, index) => {
    const value = series.values[index];
    if (value === null || value === undefined) return;
    const last = found.at(-1);
    const to = series.at_s[index + 1] ?? end_s;
    if (last !== undefined && last.to === from && last.text === String(value)) last.to = to;
    else found.push({ from, to, text: String(value) });
  });
  return found;
}

/** The value that holds at a moment; of a motion the one between. */
export function valueAt(series: Series, at: number): number | string | null {
  const after = series.at_s.findIndex((one) => one > at);
  const index = (after < 0 ? series.at_s.length : after) - 1;
  if (index < 0) return null;
  const value = series.values[index] ?? null;
  const [next_s, next] = [series.at_s[index + 1], series.values[index + 1]];
  if (!series.is_motion || next_s === undefined || typeof value !== "number" || typeof next !== "number") return value;
  const begin = series.at_s[index] as number;
  return next_s > begin ? value + ((next - value) * (at - begin)) / (next_s - begin) : next;
}

export const csvOf = (all: readonly Series[]): string =>
  ["point,unit,seconds,value", ...all.flatMap(rowsOf)].join("\r\n") + "\r\n";

const quoted = (text: string): string => `"${text.replaceAll('"', '""')}"`;

const rowsOf = ({ point, unit, at_s, values }: Series): string[] =>
  at_s.map((at, index) => {
    const value = values[index] ?? null;
    const shown = value === null ? "" : typeof value === "string" ? quoted(value) : value;
    return [quoted(point), quoted(unit), at, shown].join(",");
  });

/** The points, those first whose value has changed. */
export function movedFirst(series: readonly Series[]): string[] {
  const moved = ({ values }: Series) =>
    values.some((value) => value !== null && value !== values.find((one) => one !== null));
  return [...series.filter(moved), ...series.filter((one) => !moved(one))].map(({ point }) => point);
}
