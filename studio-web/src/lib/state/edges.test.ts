import { expect, test } from "vitest";
import { Edges } from "./edges";

function three(): Edges {
  const edges = new Edges();
  edges.take("a", 100n, 0);
  edges.take("a", 200n, 1);
  edges.take("a", 300n, 1);
  edges.take("a", 400n, 0);
  return edges;
}

test("levels hold until the next edge", () => {
  const edges = three();
  expect([99n, 100n, 199n, 200n, 399n, 400n, 900n].map((at) => edges.at("a", at))).toEqual([NaN, 0, 0, 1, 1, 0, 0]);
  expect(edges.at("b", 100n)).toBeNaN();
});

test("intervals are cut where the window ends", () => {
  const found: unknown[] = [];
  three().intervals("a", 250n, 450n, (from, to, level) => found.push([from, to, level]));
  expect(found).toEqual([
    [250n, 400n, 1],
    [400n, 450n, 0],
  ]);
});

test("the oldest edges are forgotten", () => {
  const edges = new Edges();
  for (let index = 0; index < 50_000; index++) edges.take("a", BigInt(index), index % 2);
  expect(edges.at("a", 49_999n)).toBe(1);
  expect(edges.at("a", 10_000n)).toBeNaN();
});

test("where time has gone back, what was later is forgotten", () => {
  const edges = three();
  edges.forgetAfter(200n);
  expect(edges.at("a", 900n)).toBe(1);
  edges.take("a", 250n, 0);
  expect([200n, 250n].map((at) => edges.at("a", at))).toEqual([1, 0]);
  edges.forgetAfter(99n);
  expect(edges.at("a", 900n)).toBeNaN();
});

test("what happened while nothing came is unknown, until the past is asked for it", () => {
  const edges = three();
  edges.lose(500n);
  edges.take("a", 700n, 0);
  expect([499n, 500n, 699n, 700n].map((at) => edges.at("a", at))).toEqual([0, NaN, NaN, 0]);
  edges.takeEarlier([["a", 350n, 1], ["a", 600n, 0], ["b", 350n, 1]], 350n, 700n); // prettier-ignore
  expect([200n, 350n, 599n, 600n, 700n].map((at) => edges.at("a", at))).toEqual([1, 1, 1, 0, 0]);
  expect(edges.at("b", 400n)).toBe(1);
});
