import { expect, test } from "vitest";
import { Batches } from "./batches";

test("the next batch comes when the last one has been taken, with all that has come meanwhile", () => {
  const handed: number[][] = [];
  const batches = new Batches<number>((batch) => void handed.push(batch), 100);
  for (const message of [1, 2, 3]) batches.add(message);
  expect(handed).toEqual([[1]]);
  batches.taken();
  expect(handed).toEqual([[1], [2, 3]]);
  batches.taken();
  batches.add(4);
  expect(handed).toEqual([[1], [2, 3], [4]]);
});

test("beyond its bound the oldest are dropped", () => {
  const handed: number[][] = [];
  const batches = new Batches<number>((batch) => void handed.push(batch), 3);
  for (let message = 0; message < 10; message++) batches.add(message);
  batches.taken();
  expect(handed).toEqual([[0], [7, 8, 9]]);
});
