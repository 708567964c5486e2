import type { Datasheet, Point } from "../../lib/state/model";
import { blockRows, groupOf, isBlock, type Row } from "./rows";

/** Tag lists as CSV, in the columns of `steptwin registers --format tags`: docs/hmi.md. */
const COLUMNS = [
  "tag",
  "data_type",
  "access",
  "area",
  "address_0",
  "address_1",
  "reference",
  "registers",
  "word_order",
  "unit",
  "minimum",
  "maximum",
  "comment",
] as const;

const AREAS: Readonly<Record<string, [string, string]>> = {
  coil: ["0x coil", "0"],
  input: ["1x input", "1"],
  "holding register": ["4x holding register", "4"],
};
const DATA_TYPES: Readonly<Record<string, string>> = { BIT: "BOOL", "REAL/DINT": "REAL" };
const MOST_TAGS = 2000;

/** What has an address; the others are of the page alone. */
export function tagList(rows: readonly Row[]): string {
  const lines = rows.flatMap(({ path, point }) => {
    const [address] = point.addresses;
    const area = AREAS[address?.space ?? ""];
    if (address === undefined || area === undefined || typeof address.place !== "number") return [];
    const values: Record<(typeof COLUMNS)[number], string | number> = {
      tag: path,
      data_type: DATA_TYPES[address.type] ?? address.type,
      access: point.access.toUpperCase(),
      area: area[0],
      address_0: address.place,
      address_1: address.place + 1,
      reference: area[1] + String(address.place + 1).padStart(5, "0"),
      registers: address.words,
      word_order: address.words === 2 ? "low word first" : "",
      unit: point.unit,
      minimum: point.limits?.low ?? "",
      maximum: point.limits?.high ?? "",
      comment: point.meaning,
    };
    return [COLUMNS.map((column) => quoted(String(values[column]))).join(",")];
  });
  return [COLUMNS.join(","), ...lines, ""].join("\n");
}

const quoted = (text: string): string => (/[",;\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

export interface Imported {
  rows: Row[];
  /** Tags that name nothing of this controller. */
  unknown: string[];
}

/** The points that a list names: by `tag`, else by `address_0` and `data_type`. Throws for a text without these columns. */
export function readTags(text: string, sheet: Datasheet): Imported {
  const [head, ...lines] = readCsv(text.replace(/^\ufeff/, ""));
  const place = (column: string) => (head ?? []).findIndex((name) => name.trim().toLowerCase() === column);
  const [tag, address, type] = [place("tag"), place("address_0"), place("data_type")];
  if (tag < 0 && address < 0) throw new Error("tag, address_0");
  const imported: Imported = { rows: [], unknown: [] };
  for (const line of lines.slice(0, MOST_TAGS)) {
    if (line.every((cell) => !cell.trim())) continue;
    const name = line[tag]?.trim() ?? "";
    const row = byName(name, sheet) ?? byAddress(line[address]?.trim() ?? "", line[type]?.trim() ?? "", sheet);
    if (row === null) imported.unknown.push(name || (line[address] ?? ""));
    else if (!imported.rows.some(({ path }) => path === row.path)) imported.rows.push(row);
  }
  return imported;
}

/** The row of a name as this page writes it: `M1_ACC`, `USER_REGISTER[12]:real`. */
export function byName(name: string, sheet: Datasheet): Row | null {
  const upper = name.toUpperCase();
  const found = sheet.points.find((point) => point.path.toUpperCase() === upper && !isBlock(point));
  if (found !== undefined) return { path: found.path, point: found, group: groupOf(found.path, sheet) };
  const cell = /^(.+)\[(\d{1,5})\](?::(\w+))?$/.exec(upper);
  const block = cell && sheet.points.find((point) => isBlock(point) && point.path.toUpperCase() === cell[1]);
  return block ? cellOf(block, Number(cell[2]), cell[3] ?? "WORD") : null;
}

function byAddress(text: string, type: string, sheet: Datasheet): Row | null {
  if (!/^\d{1,5}$/.test(text)) return null;
  const number = Number(text);
  const isBit = type.toUpperCase() === "BOOL";
  for (const point of sheet.points) {
    const [address] = point.addresses;
    if (address === undefined || typeof address.place !== "number" || (address.type === "BIT") !== isBit) continue;
    if (isBlock(point) && number >= address.place && number < address.place + address.words)
      return cellOf(point, number - address.place, type.toUpperCase() || "WORD");
    if (address.place === number) return { path: point.path, point, group: groupOf(point.path, sheet) };
  }
  return null;
}

function cellOf(block: Point, index: number, type: string): Row | null {
  const [row] = blockRows(block, index, type, 1);
  return row !== undefined && row.path.startsWith(`${block.path}[${index}]`) ? row : null;
}

/** Comma or semicolon, whichever the first line has more of; cells in quotes may have both, and line ends. */
function readCsv(text: string): string[][] {
  const first = text.slice(0, (text + "\n").indexOf("\n"));
  const separator = first.split(";").length > first.split(",").length ? ";" : ",";
  const rows: string[][] = [[]];
  let cell = "";
  let isQuoted = false;
  for (let index = 0; index < text.length; index++) {
    const sign = text[index]!;
    if (isQuoted) {
      if (sign !== '"') cell += sign;
      else if (text[index + 1] === '"') cell += text[++index];
      else isQuoted = false;
    } else if (sign === '"') isQuoted = true;
    else if (sign === separator || sign === "\n") {
      rows.at(-1)!.push(cell);
      cell = "";
      if (sign === "\n") rows.push([]);
    } else if (sign !== "\r") cell += sign;
  }
  rows.at(-1)!.push(cell);
  return rows;
}
