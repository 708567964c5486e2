import type { Requests, Sentence, SubjectEvent } from "../../lib/protocol/types";

export type FrameEvent = Extract<SubjectEvent, { kind: "frame" }>;

export interface Frame {
  number: number;
  time_ns: bigint;
  line: string;
  client: string;
  direction: "in" | "out";
  data: Uint8Array;
  words: string;
  message: Sentence | undefined;
  isError: boolean;
}

export function bytesOf(hex: string): Uint8Array {
  return Uint8Array.from(hex.match(/../g) ?? [], (pair) => parseInt(pair, 16));
}

export const hexOf = (data: Uint8Array): string =>
  Array.from(data, (byte) => byte.toString(16).padStart(2, "0")).join(" ");

/** Whether these are the bytes of a Modbus TCP frame: protocol 0 and the length of what follows. */
export function isTcp(data: Uint8Array): boolean {
  return (
    data.length >= 8 &&
    data[2] === 0 &&
    data[3] === 0 &&
    ((data[4] as number) << 8) + (data[5] as number) === data.length - 6
  );
}

/** `isModbus`: of a Modbus line, where bytes without a frame and exception answers are errors. */
export function frameOf(event: FrameEvent, isModbus: boolean): Frame {
  const data = bytesOf(event.data);
  const code = data[isTcp(data) ? 7 : 1] ?? 0;
  return {
    number: event.number,
    time_ns: BigInt(event.time_ns),
    line: event.controller,
    client: event.client,
    direction: event.direction,
    data,
    words: event.words,
    message: event.messages?.words,
    isError: data.length === 0 || (isModbus && event.direction === "out" && code >= 0x80),
  };
}

/** Characters of a request that the studio takes, less than its 1 MiB. */
const ROOM = 1_000_000;

/** The newest frames that a request has room for, as the request `capture` has them. */
export function sendable(frames: readonly Frame[]): Requests["capture"]["request"]["frames"] {
  let room = ROOM;
  const rows = [];
  for (const { time_ns, line, client, direction, data } of [...frames].reverse()) {
    const row = {
      time_ns: String(time_ns),
      controller: line,
      client,
      direction,
      data: hexOf(data).replaceAll(" ", ""),
    };
    room -= JSON.stringify(row).length + 1;
    if (room < 0) break;
    rows.push(row);
  }
  return rows.reverse();
}

/** How many come, how many are errors, and how long answers take. */
export class Statistics {
  count = 0;
  errors = 0;
  longest_ms = 0;
  private answered = 0;
  private waited_ms = 0;
  private readonly asked = new Map<string, bigint>();
  private recent: bigint[] = [];

  take(frame: Frame): void {
    this.count++;
    this.errors += Number(frame.isError);
    const client = `${frame.line}/${frame.client}`;
    if (frame.direction === "in") {
      this.asked.set(client, frame.time_ns);
      this.recent.push(frame.time_ns);
      return;
    }
    const asked = this.asked.get(client);
    if (asked === undefined) return;
    this.asked.delete(client);
    const took_ms = Number(frame.time_ns - asked) / 1e6;
    this.answered++;
    this.waited_ms += took_ms;
    this.longest_ms = Math.max(this.longest_ms, took_ms);
  }

  get mean_ms(): number {
    return this.answered ? this.waited_ms / this.answered : NaN;
  }

  /** Requests in the last second of virtual time. */
  rate(now_ns: bigint): number {
    const first = this.recent.findIndex((time_ns) => time_ns > now_ns - 1_000_000_000n);
    this.recent = first < 0 ? [] : this.recent.slice(first);
    return this.recent.length;
  }
}

export function csvOf(frames: readonly Frame[]): string {
  const rows = frames.map(({ time_ns, line, client, direction, data, words }) =>
    [(Number(time_ns) / 1e9).toFixed(9), line, client, direction, hexOf(data), `"${words.replaceAll('"', '""')}"`].join(
      ",",
    ),
  );
  return ["time [s],line,client,direction,bytes,meaning", ...rows, ""].join("\r\n");
}
