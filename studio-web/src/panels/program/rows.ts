/** A row of a position table: a name, and up to four values; null leaves an axis alone. */
export const rowOf = (name: string, values: readonly (number | null)[]): string =>
  [name, ...values.map((value) => (value === null ? "x" : numberText(value)))].join(";");

/** As many digits as a REAL has, without exponent. */
export function numberText(value: number): string {
  const text = String(Number(value.toPrecision(7)));
  return text.includes("e") ? String(Number(value.toFixed(6))) : text;
}

export const isName = (name: string): boolean => /^[A-Za-z_][A-Za-z0-9_]*$/.test(name);

/** The table with a row: in the place of the one of that name, else at the end. Gives the number of its line, from 1, too. */
export function withRow(table: string, name: string, row: string): [table: string, line: number] {
  const lines = table.split("\n");
  const at = lines.findIndex((line) => line.split(";")[0]?.trim().toUpperCase() === name.toUpperCase());
  if (at >= 0) return [lines.map((line, index) => (index === at ? row : line)).join("\n"), at + 1];
  while (lines.length && lines.at(-1)?.trim() === "") lines.pop();
  return [[...lines, row, ""].join("\n"), lines.length + 1];
}
