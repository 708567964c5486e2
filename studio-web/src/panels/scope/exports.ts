import { shownTime } from "../../lib/state/numbers";
import type { Signal } from "./signals";

export type Value = (signal: Signal, time_ns: bigint) => number;

/** Rows of a table: the moment in seconds, then each signal; empty where it is not known. */
export function csvOf(signals: readonly Signal[], value: Value, from_ns: bigint, to_ns: bigint, rows: number): string {
  const name = ({ label, unit }: Signal) => `"${label}${unit ? ` [${unit}]` : ""}"`;
  const lines = [["time [s]", ...signals.map(name)].join(",")];
  for (const at of moments(from_ns, to_ns, rows)) {
    const values = signals.map((signal) => value(signal, at));
    lines.push([shownTime(at, 9), ...values.map((one) => (Number.isNaN(one) ? "" : String(one)))].join(","));
  }
  return `${lines.join("\r\n")}\r\n`;
}

/** A value change dump (IEEE 1364) in ns: levels as wires, curves as reals at `rows` moments. */
export function vcdOf(signals: readonly Signal[], value: Value, from_ns: bigint, to_ns: bigint, rows: number): string {
  const lines = ["$timescale 1 ns $end", "$scope module studio $end"];
  for (const [index, { id, kind }] of signals.entries()) {
    const type = kind === "level" ? "wire 1" : "real 64";
    lines.push(`$var ${type} ${codeOf(index)} ${id.replaceAll(/\s/g, "_")} $end`);
  }
  lines.push("$upscope $end", "$enddefinitions $end");
  const shown = new Map<number, number>();
  for (const at of moments(from_ns, to_ns, rows)) {
    const changes: string[] = [];
    for (const [index, signal] of signals.entries()) {
      const now = value(signal, at);
      if (Object.is(shown.get(index), now)) continue;
      shown.set(index, now);
      changes.push(change(signal, now, codeOf(index)));
    }
    if (changes.length) lines.push(`#${at}`, ...changes);
  }
  return `${lines.join("\n")}\n#${to_ns}\n`;
}

function change({ kind }: Signal, value: number, code: string): string {
  if (kind === "level") return `${Number.isNaN(value) ? "x" : value}${code}`;
  return `r${Number.isNaN(value) ? 0 : value} ${code}`;
}

/** Identifiers of a dump: printable characters. */
function codeOf(index: number): string {
  const digit = String.fromCharCode(33 + (index % 94));
  return index < 94 ? digit : digit + codeOf(Math.floor(index / 94) - 1);
}

function moments(from_ns: bigint, to_ns: bigint, rows: number): bigint[] {
  const begin = from_ns < 0n ? 0n : from_ns;
  const steps = BigInt(Math.max(1, rows - 1));
  return Array.from({ length: rows }, (_, row) => begin + ((to_ns - begin) * BigInt(row)) / steps);
}
