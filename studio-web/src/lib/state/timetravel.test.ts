import { expect, test } from "vitest";
import { RequestError } from "../protocol/connection";
import { TimeTravel, type Past } from "./timetravel.svelte";
import type { Ask } from "./watch.svelte";

/** A studio that answers when it is told to. */
function rig(moments: bigint[] = []) {
  const asked: (string | null)[] = [];
  const answers: { done: () => void; failed: (error: Error) => void }[] = [];
  const shown: (string | null)[] = [];
  const reported: unknown[] = [];
  const ask = ((_: string, { to_ns }: { to_ns: string | null }) => {
    asked.push(to_ns);
    return new Promise<unknown>((done, failed) => answers.push({ done: () => done(null), failed }));
  }) as unknown as Ask;
  const timeTravel = new TimeTravel(ask, {
    show: (past) => void shown.push(past?.time_ns ?? null),
    moments: () => moments,
    present: () => 10_000_000_000n,
    report: (error) => void reported.push(error),
  });
  const settled = async () => {
    for (let turn = 0; turn < 5; turn++) await Promise.resolve();
  };
  return {
    timeTravel,
    asked,
    shown,
    reported,
    answer: async () => (answers.shift()!.done(), await settled()),
    refuse: async (error: Error) => (answers.shift()!.failed(error), await settled()),
  };
}

test("of the moments that were wanted meanwhile the last is asked for", async () => {
  const { timeTravel, asked, answer } = rig();
  for (const moment of [1n, 2n, 3n]) timeTravel.go(moment);
  expect(asked).toEqual(["1"]);
  await answer();
  expect(asked).toEqual(["1", "3"]);
  timeTravel.live();
  timeTravel.live();
  await answer();
  await answer();
  expect(asked).toEqual(["1", "3", null]);
  expect(timeTravel.moment).toBeNull();
});

test("a moment lies between the beginning and the present", () => {
  const { timeTravel } = rig();
  timeTravel.go(-5n);
  expect(timeTravel.moment).toBe(0n);
  timeTravel.go(99_000_000_000n);
  expect(timeTravel.moment).toBe(10_000_000_000n);
});

test("steps go to where something happened, and behind the last to the present", () => {
  const { timeTravel } = rig([4_000_000_000n, 7_000_000_000n]);
  timeTravel.step(-1);
  expect(timeTravel.moment).toBe(7_000_000_000n);
  timeTravel.step(-1);
  timeTravel.step(-1);
  expect(timeTravel.moment).toBe(3_000_000_000n);
  timeTravel.step(1);
  timeTravel.step(1);
  expect(timeTravel.moment).toBe(7_000_000_000n);
  timeTravel.step(1);
  expect(timeTravel.moment).toBeNull();
});

test("what is refused is reported, and the page shows what the studio shows", async () => {
  const { timeTravel, reported, refuse } = rig();
  timeTravel.go(5n);
  await refuse(new RequestError("misuse", "to_ns = 5: the past is kept from 7 to 9 ns"));
  expect(timeTravel.moment).toBeNull();
  expect(reported).toHaveLength(1);
  timeTravel.take({ time_ns: "8" } as Past);
  timeTravel.go(5n);
  await refuse(new RequestError("misuse", "no"));
  expect(timeTravel.moment).toBe(8n);
});

test("a connection that is lost is no error of time travel", async () => {
  const { timeTravel, reported, refuse, shown } = rig();
  timeTravel.go(5n);
  timeTravel.forget();
  await refuse(new RequestError("closed", "gone"));
  expect([timeTravel.moment, reported, shown]).toEqual([null, [], [null]]);
});
