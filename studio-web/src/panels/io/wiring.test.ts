import { expect, test } from "vitest";
import type { Connection, Model } from "../../lib/state/model";
import { endsOf, nodesOf } from "./wiring";

const wire = (source: string, target: string, more: Partial<Connection> = {}): Connection => ({
  source,
  target,
  inverted: false,
  delay_ns: 0,
  join: null,
  ...more,
});

const model = (connections: Connection[]): Model =>
  ({
    controllers: [{ name: "cell", sheet: { title: "MIC488" } }],
    elements: [
      { name: "safety", kind: "relay" },
      { name: "spare", kind: "gate" },
    ],
    connections,
  }) as unknown as Model;

test("each controller and element has its connected terminals", () => {
  const [cell, safety, ...others] = nodesOf(model([wire("x.switch1", "cell.IN1"), wire("cell.OUT1", "safety.coil")]));
  expect(cell?.inputs).toEqual([
    { terminal: "cell.IN1", short: "IN1", join: null, ends: [{ name: "x.switch1", inverted: false, delay_ns: 0 }] },
  ]);
  expect(cell?.outputs.map(({ short, ends }) => [short, ends[0]?.name])).toEqual([["OUT1", "safety.coil"]]);
  expect([safety?.name, safety?.kind, safety?.inputs.length]).toEqual(["safety", "relay", 1]);
  expect(others).toEqual([]);
});

test("contacts that share an input are one terminal with several ends", () => {
  const share = { inverted: true, join: "series" };
  const [safety] = nodesOf(model([wire("stop", "safety.coil", share), wire("curtain", "safety.coil", share)]));
  expect(safety?.inputs).toHaveLength(1);
  expect(safety?.inputs[0]?.join).toBe("series");
  expect(safety?.inputs[0]?.ends.map(({ name }) => name)).toEqual(["stop", "curtain"]);
});

test("terminals are in the order of their numbers", () => {
  const [cell] = nodesOf(model([wire("b", "cell.IN10"), wire("a", "cell.IN2")]));
  expect(cell?.inputs.map(({ short }) => short)).toEqual(["IN2", "IN10"]);
});

test("an output may drive several inputs", () => {
  const connections = [wire("cell.OUT1", "safety.coil"), wire("cell.OUT1", "cell.IN2", { delay_ns: 5_000_000 })];
  const [cell] = nodesOf(model(connections));
  expect(cell?.outputs).toHaveLength(1);
  expect(cell?.outputs[0]?.ends.map(({ delay_ns }) => delay_ns)).toEqual([0, 5_000_000]);
  expect(endsOf(connections, "cell.OUT1")).toEqual(["safety.coil", "cell.IN2"]);
  expect(endsOf(connections, "cell.IN2")).toEqual(["cell.OUT1"]);
});
