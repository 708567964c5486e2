/** A curve in a picture: the points of an SVG polyline, and where the numbers of its scale stand. */

export interface Box {
  left: number;
  top: number;
  width: number;
  height: number;
}

export interface Scale {
  low: number;
  high: number;
}

export type CurvePoint = readonly number[];

/** From 0, so that the height of a curve says something. */
export function scaleOf(values: readonly number[]): Scale {
  const low = Math.min(0, ...values);
  const high = Math.max(0, ...values);
  return { low, high: high === low ? low + 1 : high };
}

export const across = (value: number, scale: Scale, box: Box): number =>
  box.left + ((value - scale.low) / (scale.high - scale.low)) * box.width;

export const up = (value: number, scale: Scale, box: Box): number =>
  box.top + box.height - ((value - scale.low) / (scale.high - scale.low)) * box.height;

/** `column` is the place of the value in a point, whose first number is the time. */
export function polyline(points: readonly CurvePoint[], column: number, time: Scale, scale: Scale, box: Box): string {
  return points
    .map((point) => `${across(point[0]!, time, box).toFixed(1)},${up(point[column]!, scale, box).toFixed(1)}`)
    .join(" ");
}

/** Round numbers inside of a scale, `most` at most. */
export function ticksOf({ low, high }: Scale, most = 5): number[] {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= rough) ?? rough;
  const ticks: number[] = [];
  for (let index = Math.ceil(low / step); index * step <= high * (1 + 1e-12); index++)
    ticks.push(Number((index * step).toPrecision(12)));
  return ticks;
}
