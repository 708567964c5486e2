import { expect, test } from "vitest";
import type { FaultKind } from "../../lib/state/faults.svelte";
import type { Model } from "../../lib/state/model";
import type { Standing } from "../../lib/state/standing";
import { Afflicted, signsOf } from "./faultsof";

const MODEL = {
  controllers: [{ name: "table" }, { name: "drum" }],
  mechanics: [{ name: "x", controller: "table", axis: "2" }],
  elements: [
    { name: "cup", kind: "vacuum" },
    { name: "cup2", kind: "vacuum" },
  ],
  connections: [
    { source: "table.OUT1", target: "cup.ejector" },
    { source: "cup.held", target: "table.IN5" },
    { source: "x.switch1", target: "table.IN1" },
    { source: "x.switch2", target: "drum.A1" },
    { source: "cup2.held", target: "table.IN6" },
  ],
} as unknown as Model;
const kind = (elements: string[], ...parameters: string[]) =>
  ({ elements, parameters: parameters.map((name) => ({ name })) }) as FaultKind;

test("faults that can happen to a thing are given it", () => {
  const cup = new Afflicted(MODEL, "cup");
  expect(cup.fixed(kind(["vacuum"], "element"))).toEqual({ element: "cup" });
  expect(cup.fixed(kind(["cylinder"], "element"))).toBeNull();
  expect(cup.fixed(kind([], "axis", "machine"))).toBeNull();
  expect(cup.fixed(kind([], "pin", "machine"))).toEqual({ machine: "table" });
  expect(cup.pins).toEqual(["OUT1", "IN5"]);
  const x = new Afflicted(MODEL, "x");
  expect(x.fixed(kind([], "axis", "machine"))).toEqual({ machine: "table", axis: "2" });
  expect([x.pins, x.fixed(kind([], "pin", "machine"))]).toEqual([null, null]);
  expect(x.fixed(kind([], "line"))).toBeNull();
});

test("faults are about a thing by its name, its axis, and the pins that it is wired to", () => {
  const about = (name: string, ...faults: string[]) => faults.map((fault) => new Afflicted(MODEL, name).has(fault));
  expect(about("cup", "leak element=cup", "leak element=cup2", "stuck pin=IN5", "stuck pin=IN5 machine=drum")).toEqual([
    true,
    false,
    true,
    false,
  ]);
  expect(about("x", "stall axis=2 machine=table", "stall axis=2 machine=drum", "stall axis=1")).toEqual([
    true,
    false,
    false,
  ]);
});

test("what stands is marked at the thing, and at those that are wired to its pin or moved by its axis", () => {
  const marked = (...standing: [Standing["kind"], string][]) =>
    Object.fromEntries(
      signsOf(
        MODEL,
        standing.map(([kind, name]) => ({ kind, name }) as Standing),
      ),
    );
  expect(marked()).toEqual({});
  expect(marked(["program", "table"], ["fault", "bus"])).toEqual({});
  expect(marked(["fault", "cup"], ["element", "cup"], ["axis", "table.M2"])).toEqual({ cup: "⚡", x: "▲" });
  expect(marked(["fault", "table.IN5"], ["fault", "drum.A1"], ["axis", "drum.M2"])).toEqual({ cup: "⚡", x: "⚡" });
});
