// What has a value in a program, from the semantic tokens of the Language Server Protocol.

export interface Name {
  readonly line: number;
  readonly start: number;
  readonly length: number;
}

/** Variables, registers and constants. */
const WITH_VALUE = ["variable", "property", "macro"];

/** Each token has five numbers: lines and characters from the previous one, length, type, modifiers. */
export function namesIn(data: Uint32Array | readonly number[], types: readonly string[]): Name[] {
  const found: Name[] = [];
  let line = 0;
  let start = 0;
  for (let at = 0; at + 5 <= data.length; at += 5) {
    const [lines = 0, characters = 0, length = 0, type = 0] = data.slice(at, at + 4);
    start = lines === 0 ? start + characters : characters;
    line += lines;
    if (WITH_VALUE.includes(types[type] ?? "")) found.push({ line, start, length });
  }
  return found;
}

/** The expression for the debugger: in WBC the name itself; in programs of the M1486 numbers of lines and registers. */
export function expressionOf(language: string, line: string, name: Name): string {
  const text = line.slice(name.start, name.start + name.length);
  if (language !== "m1486") return text;
  const number = text.replace(/\s/g, "");
  return /[<>]\s*$/.test(line.slice(0, name.start)) ? `register${number}` : `B${number}`;
}
