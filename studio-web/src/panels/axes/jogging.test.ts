import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { RequestError } from "../../lib/protocol/connection";
import type { AxisModel } from "../../lib/state/model";
import type { Studio } from "../../lib/state/studio.svelte";
import { Jogging } from "./jogging.svelte";

const AXIS = {
  id: "table.1",
  controller: "table",
  axis: 1,
  number: 1,
  fastest: null,
  velocities: null,
  pulses_per_unit: 100,
};

/** Requests that have no answer yet. */
let open: { name: string; answer: (value: unknown) => void; refuse: (error: unknown) => void }[];
const report = vi.fn();

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("localStorage", { getItem: () => null, setItem: () => undefined });
  open = [];
  report.mockReset();
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

function jogging(): Jogging {
  const studio = {
    ask: (name: string) => new Promise((answer, refuse) => open.push({ name, answer, refuse })),
    report,
    leases: [],
    axis: () => ({ isMoving: () => false }),
    now: () => 0n,
  };
  return new Jogging(studio as unknown as Studio, () => null);
}

test("a jog whose predecessor is refused late still ends when it is let go", async () => {
  const jogs = jogging();
  const axis = AXIS as unknown as AxisModel;
  const isOver = vi.fn();
  jogs.begin(axis, 1, isOver);
  jogs.end(axis);
  jogs.begin(axis, 1, vi.fn());
  const [first, second] = open;
  first?.refuse(new RequestError("refusal", "not yet"));
  await vi.advanceTimersByTimeAsync(1);
  second?.answer({ lease: 2, lasts_ms: 250 });
  await vi.advanceTimersByTimeAsync(1);
  jogs.end(axis);
  await vi.advanceTimersByTimeAsync(1000);
  expect(open.map(({ name }) => name)).toEqual(["jog", "jog", "let_go"]);
  expect(report).toHaveBeenCalledOnce();
  expect(isOver).toHaveBeenCalledOnce();
});
