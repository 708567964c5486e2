import { expect, test } from "vitest";
import { RequestError } from "../protocol/connection";
import { EarlierEvents, type PastEvents } from "./earlierevents.svelte";
import type { Ask } from "./watch.svelte";

const SECOND = 1_000_000_000n;

function rig(begin_ns: bigint) {
  const asked: string[] = [];
  const parts: PastEvents[] = [];
  const ask = ((_: string, { from_ns, to_ns }: { from_ns: string; to_ns: string }) => {
    asked.push(`${BigInt(from_ns) / SECOND} ${BigInt(to_ns) / SECOND}`);
    if (BigInt(to_ns) <= begin_ns) return Promise.reject(new RequestError("misuse", "the past is kept from there"));
    const from = BigInt(from_ns) < begin_ns ? begin_ns : BigInt(from_ns);
    return Promise.resolve({ from_ns: String(from), to_ns, state: {}, faults: [], plans: [], events: [] });
  }) as unknown as Ask;
  const earlier = new EarlierEvents(ask, (part) => parts.push(part));
  const want = (from_ns: bigint) =>
    new Promise<void>((resolve) => (earlier.want(from_ns, resolve), setTimeout(resolve)));
  return { asked, parts, earlier, want };
}

test("more is asked for until what is kept is over", async () => {
  const { asked, earlier } = rig(5n * SECOND);
  await earlier.more();
  earlier.begin(30n * SECOND);
  await Promise.all([earlier.more(), earlier.more()]);
  await earlier.more();
  await earlier.more();
  await earlier.more();
  expect([asked, earlier.isOver]).toEqual([["10 30", "0 10", "0 5"], true]);
});

test("the past is asked for in parts, as far as it is wanted and kept", async () => {
  const { asked, parts, earlier, want } = rig(5n * SECOND);
  await want(0n);
  expect(asked).toEqual([]);
  earlier.begin(50n * SECOND);
  await want(60n * SECOND);
  expect(asked).toEqual([]);
  for (let time = 0; time < 5; time++) await want(-1n);
  expect(asked).toEqual(["30 50", "10 30", "0 10", "0 5"]);
  expect(parts).toHaveLength(3);
});
