import { expect, test } from "vitest";
import { bytesOf, csvOf, frameOf, isTcp, sendable, Statistics, type Frame, type FrameEvent } from "./frame";

let number = 0;
function frame(time_ms: number, direction: "in" | "out", hex: string, client = "tcp-1"): Frame {
  const data = hex.replaceAll(" ", "");
  const event = { kind: "frame", controller: "bus", number: ++number, time_ns: String(BigInt(time_ms) * 1_000_000n) };
  return frameOf({ ...event, client, direction, data, words: 'read "M1"' } as unknown as FrameEvent, true);
}

const ASKED = "00 01 00 00 00 06 01 03 27 24 00 02";
const ANSWERED = "00 01 00 00 00 07 01 03 04 00 00 00 00";
const REFUSED = "00 02 00 00 00 03 01 83 02";
const RTU = "01 03 27 24 00 02 8e b4";

test("Modbus TCP is told from RTU by its length", () => {
  expect(isTcp(bytesOf(ASKED.replaceAll(" ", "")))).toBe(true);
  expect(isTcp(bytesOf(RTU.replaceAll(" ", "")))).toBe(false);
});

test("exceptions and bytes without a frame are errors", () => {
  expect([ASKED, ANSWERED, REFUSED, ""].map((hex) => frame(0, "out", hex).isError)).toEqual([false, false, true, true]);
  expect(frame(0, "out", "01 83 02 c0 f1").isError).toBe(true);
});

test("answer times are those of one client", () => {
  const statistics = new Statistics();
  statistics.take(frame(100, "in", ASKED, "a"));
  statistics.take(frame(101, "in", ASKED, "b"));
  statistics.take(frame(103, "out", ANSWERED, "b"));
  statistics.take(frame(106, "out", ANSWERED, "a"));
  expect([statistics.mean_ms, statistics.longest_ms, statistics.count, statistics.errors]).toEqual([4, 6, 4, 0]);
  expect(statistics.rate(500_000_000n)).toBe(2);
  expect(statistics.rate(1_100_500_000n)).toBe(1);
});

test("CSV quotes meanings", () => {
  expect(csvOf([frame(1500, "in", RTU)])).toBe(
    `time [s],line,client,direction,bytes,meaning\r\n1.500000000,bus,tcp-1,in,${RTU},"read ""M1"""\r\n`,
  );
});

test("a request has room for the newest frames", () => {
  expect(sendable([frame(1, "in", ASKED)])).toEqual([
    { time_ns: "1000000", controller: "bus", client: "tcp-1", direction: "in", data: ASKED.replaceAll(" ", "") },
  ]);
  const many = Array.from({ length: 5000 }, (_, at) => frame(at, "out", "00".repeat(260)));
  const sent = sendable(many);
  expect(sent.length).toBeLessThan(many.length);
  expect(sent.at(-1)?.time_ns).toBe("4999000000");
  expect(JSON.stringify(sent).length).toBeLessThan(1_000_001);
});
