import type { Requests } from "../../lib/protocol/types";

export type Entry = Requests["audit"]["answer"][number];

/** The fields of a command in a line: `axis 1, to 20`. */
export const fieldsOf = ({ fields }: Entry): string =>
  Object.entries(fields)
    .map(([name, value]) => `${name} ${typeof value === "string" ? value : JSON.stringify(value)}`)
    .join(", ");

/** The newest first, those in which each word of `filter` is somewhere. */
export function chosen(entries: readonly Entry[], filter: string, failures: boolean): readonly Entry[] {
  const words = filter.toLowerCase().split(/\s+/).filter(Boolean);
  const fits = (entry: Entry) => {
    const text = `${entry.viewer} ${entry.role} ${entry.do} ${fieldsOf(entry)} ${entry.outcome}`.toLowerCase();
    return words.every((word) => text.includes(word));
  };
  return entries.filter((entry) => (!failures || entry.outcome !== "done") && fits(entry)).reverse();
}

/** A formula of a spreadsheet is a text, too. */
const cell = (text: string): string => `"${(/^[=+\-@]/.test(text) ? `'${text}` : text).replaceAll('"', '""')}"`;

export const csvOf = (entries: readonly Entry[]): string =>
  [["at", "time_ns", "viewer", "role", "do", "fields", "outcome"], ...entries.map(rowOf)]
    .map((row) => row.map(cell).join(","))
    .join("\r\n") + "\r\n";

const rowOf = (entry: Entry): string[] => [
  entry.at,
  entry.time_ns,
  entry.viewer,
  entry.role,
  entry.do,
  fieldsOf(entry),
  entry.outcome,
];
