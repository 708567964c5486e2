import type { Sentence } from "../lib/protocol/types";
import { pl } from "./pl";
import polish from "./polish.json";
import { language } from "./texts.svelte";
import { POLISH as WORDS } from "./words";

/** A text of the service, and which message it is, where it is one with an id. */
export interface Said {
  text: string;
  message?: Sentence;
}

/** A message inside of another one, or in what the editor server says; without an id it is only a text. */
export interface Inner {
  text: string;
  id?: string;
  values?: Values;
}

export const saidBy = ({ text, id, values = {} }: Inner): Said =>
  id === undefined ? { text } : { text, message: { id, values } };

/** Messages in Polish, by id: of the page itself, and of the service (src/steptwin/messages.py; tests/test_messages.py), with the places of the English ones. */
const POLISH: Readonly<Record<string, string>> = {
  ...polish,
  ...Object.fromEntries(Object.entries(pl).map(([key, text]) => [`page.${key}`, text])),
};

/** A value of a message: what somebody gave or a program measured, which stays as it is; an object is a message. */
type Value = string | number | readonly Value[] | Inner;
type Values = Readonly<Record<string, Value>>;

/** `{name}`, `{name!r}` in quotes, `{name:FORMAT}` (of a list what is between its members); doubled brackets stand for one. */
const PLACE = /\{\{|\}\}|\{(\w+)(!r)?(?::([^}]*))?\}/g;

/** The message in Polish; null where there is none. */
export function inPolish({ id, values }: Sentence): string | null {
  return (
    POLISH[id]?.replace(PLACE, (place, name?: string, quoted?: string, format?: string) => {
      if (name === undefined) return place.charAt(0);
      return shown((values as Values)[name] ?? "", quoted !== undefined, format);
    }) ?? null
  );
}

function shown(value: Value, isQuoted: boolean, format?: string): string {
  if (typeof value === "number") return format === undefined ? String(value) : formatted(value, format);
  if (typeof value === "string") return isQuoted ? quoted(value) : value;
  if ("text" in value) {
    const found =
      value.id === undefined ? (WORDS[value.text] ?? null) : inPolish({ id: value.id, values: value.values ?? {} });
    return isQuoted ? quoted(found ?? value.text) : (found ?? value.text);
  }
  return value.map((one) => shown(one, isQuoted)).join(format ?? ", ");
}

/** As Python quotes a text. */
function quoted(text: string): string {
  const quote = text.includes("'") && !text.includes('"') ? '"' : "'";
  return quote + text.replaceAll("\\", "\\\\").replaceAll(quote, `\\${quote}`).replaceAll("\n", "\\n") + quote;
}

/** A number as Python formats it: `g`, `f`, `d` and `X`, with digits behind the point, width with zeros, and sign. */
function formatted(value: number, format: string): string {
  const [, sign, width = "", digits = "6", kind] = /^(\+?)(0\d+)?(?:\.(\d+))?([gfdX])$/.exec(format) ?? [];
  const size = Math.abs(value);
  const text =
    kind === "g"
      ? general(size, Number(digits))
      : kind === "f"
        ? size.toFixed(Number(digits))
        : size.toString(kind === "X" ? 16 : 10).toUpperCase();
  return (value < 0 ? "-" : (sign ?? "")) + text.padStart(Number(width), "0");
}

/** With so many digits, without zeros at the end; very large and very small numbers with an exponent. */
function general(size: number, digits: number): string {
  const [mantissa = "", power = "0"] = size.toExponential(digits - 1).split("e");
  const exponent = Number(power);
  const short = (text: string) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
  if (exponent >= -4 && exponent < digits) return short(size.toFixed(digits - 1 - exponent));
  return `${short(mantissa)}e${exponent < 0 ? "-" : "+"}${String(Math.abs(exponent)).padStart(2, "0")}`;
}

/** In the language of the page as far as it is known; else in English, marked as English. A text without a message may be a word of data sheets. */
export function sentence(english: string, message?: Sentence): { text: string; lang: "pl" | "en" | undefined } {
  const polish = language() !== "pl" ? null : message === undefined ? (WORDS[english] ?? null) : inPolish(message);
  if (polish !== null) return { text: polish, lang: undefined };
  return { text: english, lang: "en" };
}
