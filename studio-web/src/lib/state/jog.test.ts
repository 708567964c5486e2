import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { RequestError } from "../protocol/connection";
import { DeadManJog } from "./jog";

let asked: string[];
let answer: (name: string) => Promise<unknown>;
const failed = vi.fn();
const FIELDS = { controller: "table", axis: 1, velocity: 10 };
// The answers of a fake are not typed by name.
const ask = (async (name: string) => {
  asked.push(name);
  return answer(name);
}) as Parameters<typeof DeadManJog.begin>[0];

beforeEach(() => {
  vi.useFakeTimers();
  asked = [];
  failed.mockReset();
  answer = async (name) => (name === "let_go" ? null : { lease: 3, lasts_ms: 250 });
});
afterEach(() => vi.useRealTimers());

test("it is renewed every 80 ms for as long as it is held", async () => {
  const jog = DeadManJog.begin(ask, FIELDS, failed);
  await vi.advanceTimersByTimeAsync(250);
  expect(asked).toEqual(["jog", "renew", "renew", "renew"]);
  jog.end();
  await vi.advanceTimersByTimeAsync(1000);
  expect(asked).toEqual(["jog", "renew", "renew", "renew", "let_go"]);
});

test("a shorter lease is renewed more often", async () => {
  answer = async () => ({ lease: 3, lasts_ms: 60 });
  DeadManJog.begin(ask, FIELDS, failed);
  await vi.advanceTimersByTimeAsync(60);
  expect(asked).toEqual(["jog", "renew", "renew", "renew"]);
});

test("one that was let go before its lease came is let go when it comes", async () => {
  DeadManJog.begin(ask, FIELDS, failed).end();
  await vi.advanceTimersByTimeAsync(1000);
  expect(asked).toEqual(["jog", "let_go"]);
});

test("one that is refused is not renewed", async () => {
  answer = () => Promise.reject(new RequestError("refusal", "drive off"));
  const jog = DeadManJog.begin(ask, FIELDS, failed);
  await vi.advanceTimersByTimeAsync(1000);
  jog.end();
  expect(asked).toEqual(["jog"]);
  expect(failed).toHaveBeenCalledOnce();
});

test("one that ends by itself is not renewed, and is said to have ended", async () => {
  DeadManJog.begin(ask, FIELDS, failed);
  await vi.advanceTimersByTimeAsync(10);
  answer = () => Promise.reject(new RequestError("refusal", "no lease 3"));
  await vi.advanceTimersByTimeAsync(1000);
  expect(asked).toEqual(["jog", "renew"]);
  expect(failed).toHaveBeenCalledOnce();
});
