import type { Datasheet, Point } from "../../lib/state/model";
import { hexOf, isTcp, type Frame } from "./frame";

/** A request that is sent again and again. */
export interface Polled {
  line: string;
  unit: number;
  /** Function code and data, hexadecimal without blanks. */
  pdu: string;
}

/** Longest list. */
export const MOST = 20;
/** Functions of Modbus that read, by what they read. */
const READS: Readonly<Record<string, number>> = { coil: 1, input: 2, "holding register": 3 };

export const isPolled = (value: unknown): value is Polled[] =>
  Array.isArray(value) &&
  value.length <= MOST &&
  value.every(({ line, unit, pdu }) => typeof line === "string" && typeof unit === "number" && typeof pdu === "string");

const isReadable = ({ access, addresses: [address] }: Point): boolean =>
  access !== "w" && READS[address?.space ?? ""] !== undefined;

/** What can be read by its name. */
export const readable = (sheet: Datasheet | undefined): Point[] => sheet?.points.filter(isReadable) ?? [];

/** The request, in hexadecimal, that is meant by its bytes, or by the name of what it reads; null: by neither. */
export function pduOf(typed: string, sheet: Datasheet | undefined): string | null {
  const name = typed.trim().toLowerCase();
  const address = readable(sheet).find(({ path }) => path.toLowerCase() === name)?.addresses[0];
  if (address !== undefined && typeof address.place === "number") {
    const { place, words } = address;
    const bytes = [READS[address.space] as number, place >> 8, place & 0xff, words >> 8, words & 0xff];
    return hexOf(Uint8Array.from(bytes)).replaceAll(" ", "");
  }
  const hex = typed.replaceAll(/[\s,]|0x/gi, "").toLowerCase();
  return /^([0-9a-f]{2})+$/.test(hex) ? hex : null;
}

/** Unit, function code and data of a frame on a wire of either kind, as `keyOf` writes them. */
export function askedBy({ line, data }: Frame): string {
  const from = isTcp(data) ? 6 : 0;
  const body = data.subarray(from, from ? undefined : -2); // the checksum of a serial line
  return keyOf({ line, unit: body[0] ?? 0, pdu: hexOf(body.subarray(1)).replaceAll(" ", "") });
}

export const keyOf = ({ line, unit, pdu }: Polled): string => `${line} ${unit} ${pdu}`;
