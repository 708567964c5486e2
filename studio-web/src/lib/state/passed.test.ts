import { expect, test } from "vitest";
import { Passed } from "./passed";

test("what has passed is found by its moment, and forgotten with it", () => {
  const passed = new Passed();
  for (const [time_ns, line] of [[100n, 3], [200n, 4], [300n, 3]] as const) passed.take("table", time_ns, line); // prettier-ignore
  expect([99n, 100n, 250n, 900n].map((at) => passed.at("table", at))).toEqual([NaN, 3, 4, 3]);
  expect([...passed.between("table", 150n, 300n)]).toEqual([
    { from_ns: 100n, to_ns: 200n, number: 3 },
    { from_ns: 200n, to_ns: 300n, number: 4 },
  ]);
  expect([...passed.between("drum", 0n, 300n)]).toEqual([]);
  passed.forgetAfter(200n);
  expect(passed.at("table", 900n)).toBe(4);
});

test("the oldest are forgotten", () => {
  const passed = new Passed();
  for (let index = 0; index < 50_000; index++) passed.take("bus", BigInt(index), index);
  expect([passed.at("bus", 49_999n), passed.at("bus", 1_000n)]).toEqual([49_999, NaN]);
});

test("what passed while nothing came is unknown", () => {
  const passed = new Passed();
  for (const [time_ns, line] of [[100n, 3], [300n, 4]] as const) passed.take("table", time_ns, line); // prettier-ignore
  passed.lose(200n);
  expect([199n, 200n, 300n].map((at) => passed.at("table", at))).toEqual([3, NaN, 4]);
  expect([...passed.between("table", 150n, 400n)].map(({ number }) => number)).toEqual([3, 4]);
});
