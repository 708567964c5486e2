import { writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { spawnSync } from "node:child_process";
import { expect, test } from "vitest";
import { bytesOf, csvOf, frameOf, hexOf, isTcp, Statistics, type Frame, type FrameEvent } from "./frame";
import { pcapngOf } from "./pcapng";

let number = 0;
function frame(time_ms: number, direction: "in" | "out", hex: string, client = "tcp-1"): Frame {
  const data = hex.replaceAll(" ", "");
  const event = { kind: "frame", machine: "bus", number: ++number, time_ns: String(BigInt(time_ms) * 1_000_000n) };
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

test("a capture file has a block for each frame, of whole words", () => {
  const bytes = pcapngOf([frame(1, "in", ASKED), frame(2, "out", ANSWERED), frame(3, "in", RTU), frame(4, "in", "")]);
  const view = new DataView(bytes.buffer);
  const types: number[] = [];
  for (let at = 0; at < bytes.length; at += view.getUint32(at + 4, true)) {
    expect(view.getUint32(at + view.getUint32(at + 4, true) - 4, true)).toBe(view.getUint32(at + 4, true));
    types.push(view.getUint32(at, true));
  }
  expect(types).toEqual([0x0a0d0d0a, 1, 1, 6, 6, 6]);
  expect(hexOf(bytes)).toContain(RTU);
});

const hasTshark = spawnSync("tshark", ["--version"]).status === 0;
test.skipIf(!hasTshark)("Wireshark decodes it", () => {
  const file = join(tmpdir(), `steptwin-${process.pid}.pcapng`);
  writeFileSync(
    file,
    pcapngOf([frame(1, "in", ASKED), frame(2, "out", ANSWERED), frame(3, "out", REFUSED), frame(4, "in", RTU)]),
  );
  const decoded = spawnSync("tshark", ["-r", file, "-d", "rtacser.data,mbrtu"], { encoding: "utf-8" }).stdout;
  expect(decoded.match(/Modbus\/TCP/g)).toHaveLength(3);
  expect(decoded).toContain("Exception returned");
  expect(decoded).toContain("Modbus RTU");
});
