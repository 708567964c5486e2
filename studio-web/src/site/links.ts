import { t } from "../text";

/** What a link has: a description, and the programs that it names. Nothing else is taken from one. */
export interface Linked {
  description: string;
  programs: Record<string, string>;
}

export const START = "#world=";
const PACKED = 6 * 1024;
const UNPACKED = 256 * 1024;
/** `steptwin.inpage.linked.SUFFIXES`. */
const SUFFIXES = [".prg", ".csv", ".m1486"];

const isProgram = (name: string) =>
  !/[/\\]/.test(name) && SUFFIXES.some((suffix) => name.length > suffix.length && name.endsWith(suffix));

/** The fragment of a link. Rejects with the words for a user. */
export async function pack(linked: Linked): Promise<string> {
  const bytes = new TextEncoder().encode(JSON.stringify(linked));
  if (bytes.length > UNPACKED) throw new Error(t("linkMuch", { most: UNPACKED }));
  const packed = await through(bytes, new CompressionStream("deflate-raw"), Infinity);
  if (packed.length > PACKED) throw new Error(t("linkLong", { size: packed.length, most: PACKED }));
  const text = btoa(String.fromCharCode(...packed));
  return START + text.replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** What a fragment has. Rejects with the words for a user. */
export async function unpack(fragment: string): Promise<Linked> {
  const text = fragment.slice(START.length);
  const size = Math.floor((text.length * 3) / 4);
  if (size > PACKED) throw new Error(t("linkLong", { size, most: PACKED }));
  let value: unknown;
  try {
    const packed = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (one) => one.charCodeAt(0));
    const bytes = await through(packed, new DecompressionStream("deflate-raw"), UNPACKED);
    value = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes));
  } catch (error) {
    throw error instanceof TooMuch ? error : new Error(t("linkDamaged"));
  }
  return checked(value);
}

class TooMuch extends Error {}

function checked(value: unknown): Linked {
  if (!isObject(value)) throw new Error(t("linkDamaged"));
  const { description, programs, ...others } = value;
  const [other] = Object.keys(others);
  if (other !== undefined) throw new Error(t("linkOther", { name: other }));
  if (typeof description !== "string") throw new Error(t("linkWithout", { name: "description" }));
  if (!isObject(programs)) throw new Error(t("linkWithout", { name: "programs" }));
  for (const [name, content] of Object.entries(programs))
    if (!isProgram(name) || typeof content !== "string") throw new Error(t("linkProgram", { name }));
  return { description, programs: programs as Record<string, string> };
}

const isObject = (value: unknown): value is Record<string, unknown> =>
  typeof value === "object" && value !== null && !Array.isArray(value);

/** All that comes out, up to `most` bytes: a few bytes could unpack to any size. */
async function through(bytes: Uint8Array<ArrayBuffer>, change: CompressionStream, most: number): Promise<Uint8Array> {
  const reader = new Blob([bytes]).stream().pipeThrough(change).getReader();
  const found: number[] = [];
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return Uint8Array.from(found);
    if (found.length + value.length > most) {
      void reader.cancel();
      throw new TooMuch(t("linkMuch", { most }));
    }
    for (const byte of value) found.push(byte);
  }
}
