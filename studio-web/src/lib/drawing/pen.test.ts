import { expect, test } from "vitest";
import { drawOn, Pen } from "./pen";

test("what a pen has drawn is drawn on a canvas, in its order", () => {
  const calls: unknown[] = [];
  const ctx = new Proxy({} as CanvasRenderingContext2D, {
    get: (_, name) => (...given: unknown[]) => void calls.push([name, ...given]), // prettier-ignore
    set: (_, name, value) => calls.push([name, value]) > 0,
  });
  const pen = new Pen();
  pen.fillStyle = "#123456";
  pen.fillRect(1, 2, 3, 4);
  pen.setLineDash([7, 3]);
  pen.beginPath();
  pen.moveTo(0.5, 1);
  pen.lineTo(2, 3);
  pen.stroke();
  pen.textAlign = "right";
  pen.fillText("0", 5, 6);
  pen.fillText("#123456", 7, 8);
  const drawing = pen.take(100, 50, 2);
  const canvas = { width: 0, height: 0 } as HTMLCanvasElement;
  drawOn(canvas, ctx, drawing);
  expect([canvas.width, canvas.height]).toEqual([200, 100]);
  expect(calls).toEqual([
    ["setTransform", 2, 0, 0, 2, 0, 0],
    ["fillStyle", "#123456"],
    ["fillRect", 1, 2, 3, 4],
    ["setLineDash", [7, 3]],
    ["beginPath"],
    ["moveTo", 0.5, 1],
    ["lineTo", 2, 3],
    ["stroke"],
    ["textAlign", "right"],
    ["fillText", "0", 5, 6],
    ["fillText", "#123456", 7, 8],
  ]);
  expect(pen.take(1, 1, 1).numbers).toHaveLength(0);
});
