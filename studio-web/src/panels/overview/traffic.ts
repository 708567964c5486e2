interface Counted {
  time_ns: string;
  lines: readonly { line: string; requests: number }[];
}

/** Requests in a second of virtual time between two answers, by line; none where no time has passed between them. */
export function ratesOf(before: Counted | null, now: Counted): ReadonlyMap<string, number> {
  const rates = new Map<string, number>();
  if (before === null) return rates;
  const passed_s = Number(BigInt(now.time_ns) - BigInt(before.time_ns)) / 1e9;
  for (const { line, requests } of now.lines) {
    const last = before.lines.find((one) => one.line === line);
    if (last !== undefined && passed_s > 0) rates.set(line, Math.round((requests - last.requests) / passed_s));
  }
  return rates;
}
