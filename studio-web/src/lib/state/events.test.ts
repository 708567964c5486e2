import { expect, test } from "vitest";
import type { SubjectEvent } from "../protocol/types";
import { EventLog } from "./events.svelte";

const at = (time_ns: number, kind = "note") => ({ kind, time_ns: String(time_ns), what: "" }) as SubjectEvent;
const times = (log: EventLog) => log.list.map(({ time_ns }) => Number(time_ns));

test("what happened before goes below what happens, and each event is there once", () => {
  const log = new EventLog(() => "information");
  log.begin([at(50), at(60)], 50n, 0n);
  log.take([at(70), at(71, "plan")]);
  log.takeEarlier([at(30), at(40, "edge"), at(45), at(50), at(60)], 25n);
  log.takeEarlier([at(30), at(45), at(60)], 25n);
  log.takeEarlier([at(10), at(20)], 0n);
  expect(times(log)).toEqual([70, 60, 50, 45, 30, 20, 10]);
});

test("what happened while there was no connection is there as far as the service has it", () => {
  const log = new EventLog(() => "information");
  log.begin([], 0n, 0n);
  log.take([at(10), at(20)]);
  log.begin([at(10), at(20), at(30)], 0n, 25n);
  expect([times(log), log.unknown]).toEqual([[30, 20, 10], null]);
  log.begin([at(80), at(90)], 80n, 35n);
  expect([times(log), log.unknown]).toEqual([
    [90, 80, 30, 20, 10],
    [35n, 80n],
  ]);
});
