import type { Pen } from "../../lib/drawing/pen";
import type { Passed } from "../../lib/state/passed";

/** A channel of the picture: its place, the part of time that it shows, and where a moment is. */
export interface Channel {
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
export function drawFrames(
  pen: Pen,
  channel: Channel,
  passed: Passed,
  source: string,
  colour: string,
  danger: string,
): void {
  const middle = (channel.high + channel.low) / 2;
  for (const isError of [false, true]) {
    pen.strokeStyle = isError ? danger : colour;
    pen.lineWidth = isError ? 2 : 1;
    pen.beginPath();
    const drawn = [NaN, NaN];
    for (const { from_ns, number } of passed.between(source, channel.from_ns, channel.to_ns)) {
      const [isAnswer, x] = [number & 1, Math.round(channel.x(from_ns)) + 0.5];
      if (number >> 1 !== Number(isError) || x < channel.left || drawn[isAnswer] === x) continue;
      drawn[isAnswer] = x;
      pen.moveTo(x, middle);
      pen.lineTo(x, isAnswer ? channel.low : channel.high);
    }
    pen.stroke();
  }
}

/** Room for a digit of a line number. [pixels] */
const DIGIT = 7;

/** A stroke where a statement begins, with the number of its line where there is room for it. */
export function drawStatements(
  pen: Pen,
  channel: Channel,
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
  for (const { from_ns, to_ns, number } of passed.between(source, channel.from_ns, channel.to_ns)) {
    const begin = Math.max(channel.left, Math.round(channel.x(from_ns)) + 0.5);
    if (begin !== drawn) {
      pen.moveTo(begin, channel.high);
      pen.lineTo(begin, channel.low);
      drawn = begin;
    }
    const room = Math.min(channel.right, channel.x(to_ns)) - begin;
    const words = String(number);
    if (room > words.length * DIGIT + 5) pen.fillText(words, begin + 3, (channel.high + channel.low) / 2);
  }
  pen.stroke();
}
