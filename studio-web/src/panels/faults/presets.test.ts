import { expect, test } from "vitest";
import type { FaultKind } from "../../lib/state/faults.svelte";
import type { Model } from "../../lib/state/model";
import { faultsOf, targetsOf } from "./presets";

const model = {
  controllers: [{ name: "cell" }],
  lines: [{ name: "bus" }],
  mechanics: [{ name: "x", controller: "cell", axis: "1", switches: [{ pin: "cell.IN1" }, { pin: "gate.in1" }] }],
  elements: [
    { name: "lift", kind: "cylinder", drawing: { switches: [{ pin: "cell.IN2" }] } },
    { name: "cup", kind: "vacuum", drawing: null },
  ],
  connections: [{ target: "cell.IN1" }, { target: "lift.extend" }],
} as unknown as Model;
const kinds = [
  { name: "no-air", elements: ["cylinder"] },
  { name: "leak", elements: ["vacuum"] },
  { name: "worn-jaws", elements: ["gripper"] },
] as FaultKind[];

test("presets are of what the machine has", () => {
  expect(faultsOf("noAir", model, kinds)).toEqual(["no-air element=lift", "leak element=cup"]);
  expect(faultsOf("worn", model, kinds)).toEqual([
    "bounce machine=cell pin=IN1 bounces=5 for_ms=8",
    "bounce machine=cell pin=IN2 bounces=5 for_ms=8",
    "lost-steps machine=cell axis=1 at_s=5 period_s=20",
  ]);
  expect(targetsOf("looseCable", model)).toEqual(["bus", "cell.IN1"]);
  expect(faultsOf("looseCable", model, kinds, "bus")[0]).toBe("drop line=bus probability=0.02");
  expect(faultsOf("looseCable", model, kinds, "cell.IN1")).toHaveLength(1);
  expect(faultsOf("looseCable", model, kinds)).toEqual([]);
});
