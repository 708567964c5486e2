import type { Sentence } from "../lib/protocol/types";
import { DATASHEETS } from "./datasheets";
import { DESCRIPTIONS } from "./descriptions";
import { FINDINGS } from "./findings";
import { MEANINGS } from "./meanings";
import { inPolish } from "./messages";
import { language } from "./texts.svelte";
import { POLISH } from "./words";

/**
 * Sentences of the service, which are English. `{name}` in a sentence stands for any text, `{#name}` for a number. A text that is a sentence itself is
 * translated, too; a list and what stands behind a colon part by part.
 */
const KNOWN: ReadonlyMap<string, string> = new Map([
  ...[MEANINGS, DATASHEETS, FINDINGS, DESCRIPTIONS].flatMap((table) => Object.entries(table)),
  // Single words are also names that somebody gave.
  ...Object.entries(POLISH).filter(([words]) => words.includes(" ")),
]);

const PLACE = /\{(#?\w+)\}/g;
const NUMBER = String.raw`([-−]?\d[\d .,e+-]*?)`;
/** A text right behind another one is an addition, which may be missing. */
const BEHIND = "((?:[ ,;(].*)?)";
const DEEPEST = 4;
const MOST_REMEMBERED = 1000;

interface Template {
  form: RegExp;
  names: readonly string[];
  polish: string;
  /** Letters that are not in places: of two that fit, the one with more is meant. */
  fixed: number;
  /** The longest piece of them, which is looked for first. */
  piece: string;
}

function templateOf([english, polish]: [string, string]): Template {
  const names: string[] = [];
  const pieces = english.split(PLACE);
  let form = "";
  pieces.forEach((piece, index) => {
    if (index % 2 === 0) form += piece.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
    else {
      names.push(piece);
      form += piece.startsWith("#") ? NUMBER : index > 1 && pieces[index - 1] === "" ? BEHIND : "(.+?)";
    }
  });
  const fixed = pieces.filter((_, index) => index % 2 === 0);
  const piece = fixed.reduce((longest, one) => (one.length > longest.length ? one : longest));
  return { form: new RegExp(`^${form}$`), names, polish, fixed: fixed.join("").length, piece };
}

const templates: readonly Template[] = [...KNOWN]
  .filter(([english]) => english.includes("{"))
  .map(templateOf)
  .sort((a, b) => b.fixed - a.fixed);

const remembered = new Map<string, string | null>();

/** The sentence in Polish; null where there is none. */
export function polishOf(sentence: string): string | null {
  let found = remembered.get(sentence);
  if (found === undefined) {
    found = translated(sentence, DEEPEST);
    if (remembered.size >= MOST_REMEMBERED) remembered.clear();
    remembered.set(sentence, found);
  }
  return found;
}

function translated(sentence: string, depth: number): string | null {
  const known = KNOWN.get(sentence);
  if (known !== undefined || depth === 0) return known ?? null;
  if (sentence.includes("\n")) return inParts(sentence, "\n", depth);
  for (const { form, names, polish, piece } of templates) {
    const found = sentence.includes(piece) ? form.exec(sentence) : null;
    if (found === null) continue;
    const values = Object.fromEntries(names.map((name, index) => [name, found[index + 1] ?? ""]));
    return polish.replace(PLACE, (_, name: string) => {
      const value = values[name] ?? "";
      return (name.startsWith("#") ? null : translated(value, depth - 1)) ?? value;
    });
  }
  const list = inParts(sentence, ", ", depth);
  if (list !== null) return list;
  // What a fault does comes behind its name, what is wrong behind its place.
  const [, head = "", rest = ""] = /^([^:]+): (.+)$/.exec(sentence) ?? [];
  const said = rest === "" ? null : translated(rest, depth - 1);
  return said === null ? null : `${head}: ${said}`;
}

/** Parts without words stay as they are. */
function inParts(sentence: string, between: string, depth: number): string | null {
  const parts = sentence.split(between);
  if (parts.length === 1) return null;
  let isTranslated = false;
  const said = parts.map((part) => {
    const text = part.trimStart();
    const polish = translated(text, depth - 1);
    isTranslated ||= polish !== null;
    if (polish !== null) return part.slice(0, part.length - text.length) + polish;
    return /[a-z]{2}/.test(part) ? null : part;
  });
  return isTranslated && !said.includes(null) ? said.join(between) : null;
}

/** In the language of the page as far as it is known; else in English, marked as English. */
export function sentence(english: string, message?: Sentence): { text: string; lang: "pl" | "en" | undefined } {
  const polish = language() !== "pl" ? null : message === undefined ? polishOf(english) : inPolish(message);
  if (polish !== null) return { text: polish, lang: undefined };
  return { text: english, lang: "en" };
}
