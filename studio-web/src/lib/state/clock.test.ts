import { expect, test } from "vitest";
import { WorldClock } from "./clock";

const RUNS = { running: true, speed: 1 } as const;
const s = (seconds: number) => BigInt(Math.round(seconds * 1e9));

test("it goes on between messages, at the speed of the world", () => {
  const clock = new WorldClock();
  clock.reset(s(5), { running: true, speed: 0.5 }, 1000);
  expect(clock.now(3000)).toBe(s(6));
});

test("it stands where time stands", () => {
  const clock = new WorldClock();
  clock.reset(s(5), RUNS, 0);
  clock.tell(s(5.1), { running: false, speed: 1 }, 200);
  expect(clock.now(9000)).toBe(s(5.1));
});

test("a small difference is made up for without a jump and without going back", () => {
  const clock = new WorldClock();
  clock.reset(s(10), RUNS, 0);
  clock.tell(s(10.95), RUNS, 1000);
  let last = clock.now(1000);
  expect(last).toBe(s(11));
  for (let ms = 1000; ms <= 2000; ms += 10) {
    const now = clock.now(ms);
    expect(now >= last).toBe(true);
    last = now;
  }
  expect(last).toBe(s(11.95));
});

test("a large difference is a jump", () => {
  const clock = new WorldClock();
  clock.reset(s(10), RUNS, 0);
  clock.tell(s(500), RUNS, 1000);
  expect(clock.now(1000)).toBe(s(500));
});

test("where time goes as fast as it can, its rate is measured", () => {
  const clock = new WorldClock();
  clock.reset(s(0), { running: true, speed: "max" }, 0);
  clock.tell(s(200), { running: true, speed: "max" }, 1000);
  expect(clock.now(1500)).toBe(s(300));
});

test("what happened is not in the future", () => {
  const clock = new WorldClock();
  clock.reset(s(10), RUNS, 0);
  clock.atLeast(s(10.5), 100);
  expect(clock.now(100)).toBe(s(10.5));
  clock.atLeast(s(10.2), 200);
  expect(clock.now(200)).toBe(s(10.6));
});
