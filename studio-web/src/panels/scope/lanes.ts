import type { Pen } from "../../lib/drawing/pen";
import type { Passed } from "../../lib/state/passed";

/** A lane of the picture: its place, the part of time that it shows, and where a moment is. */
export interface Lane {
  left: number;
  right: number;
  high: number;
  low: number;
  from_ns: bigint;
  to_ns: bigint;
  x(time_ns: bigint): number;
}

/** Of a frame: whether it is an answer, and whether it is an error. */
export const frameCode = (isAnswer: boolean, isError: boolean): number => Number(isAnswer) + 2 * Number(isError);

/** A stroke for each frame, at most two in a column: up to the controllers, down from them; errors are thick. */
export function drawFrames(pen: Pen, lane: Lane, passed: Passed, source: string, colour: string, danger: string): void {
  const middle = (lane.high + lane.low) / 2;
  for (const isError of [false, true]) {
    pen.strokeStyle = isError ? danger : colour;
    pen.lineWidth = isError ? 2 : 1;
    pen.beginPath();
    const drawn = [NaN, NaN];
    for (const { from_ns, number } of passed.between(source, lane.from_ns, lane.to_ns)) {
      const [isAnswer, x] = [number & 1, Math.round(lane.x(from_ns)) + 0.5];
      if (number >> 1 !== Number(isError) || x < lane.left || drawn[isAnswer] === x) continue;
      drawn[isAnswer] = x;
      pen.moveTo(x, middle);
      pen.lineTo(x, isAnswer ? lane.low : lane.high);
    }
    pen.stroke();
  }
}

/** Room for a digit of a line number. [pixels] */
const DIGIT = 7;

/** A stroke where a statement begins, with the number of its line where there is room for it. */
export function drawStatements(
  pen: Pen,
  lane: Lane,
  passed: Passed,
  source: string,
  colour: string,
  ink: string,
): void {
  pen.strokeStyle = colour;
  pen.fillStyle = ink;
  pen.lineWidth = 1;
  pen.textAlign = "left";
  pen.beginPath();
  let drawn = NaN;
  for (const { from_ns, to_ns, number } of passed.between(source, lane.from_ns, lane.to_ns)) {
    const begin = Math.max(lane.left, Math.round(lane.x(from_ns)) + 0.5);
    if (begin !== drawn) {
      pen.moveTo(begin, lane.high);
      pen.lineTo(begin, lane.low);
      drawn = begin;
    }
    const room = Math.min(lane.right, lane.x(to_ns)) - begin;
    const words = String(number);
    if (room > words.length * DIGIT + 5) pen.fillText(words, begin + 3, (lane.high + lane.low) / 2);
  }
  pen.stroke();
}
