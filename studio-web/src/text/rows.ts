import rows from "./rows.json";
import { language } from "./texts.svelte";

/** Polish for the rows of tables that the service has, by name; `{n}` stands for the number in a name, as in `M{n}_VMAX` (tests/test_messages.py). */
const ROWS: Readonly<Record<keyof typeof rows, Readonly<Record<string, string>>>> = rows;

/** What a row means: a point or command of a data sheet, a key of a configuration, a kind of faults, a parameter of one, a check. */
export function meaningOf(table: keyof typeof rows, row: string, english: string): string {
  if (language() !== "pl") return english;
  const own = ROWS[table][row];
  const [number = ""] = /\d+/.exec(row) ?? [];
  return own ?? ROWS[table][row.replace(number, "{n}")]?.replaceAll("{n}", number) ?? english;
}
