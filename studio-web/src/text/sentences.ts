import { DATASHEETS } from "./datasheets";
import { HAPPENED } from "./happened";
import { MEANINGS } from "./meanings";
import { language } from "./texts.svelte";

/** Sentences of the service, which are English. `{name}` in a sentence stands for any text. */
const KNOWN: ReadonlyMap<string, string> = new Map(
  [MEANINGS, DATASHEETS, HAPPENED].flatMap((table) => Object.entries(table)),
);

interface Template {
  form: RegExp;
  names: readonly string[];
  polish: string;
}

function templateOf([english, polish]: [string, string]): Template {
  const names: string[] = [];
  const form = english
    .replace(/[.*+?^$()|[\]\\]/g, "\\$&")
    .replace(/\{(\w+)\}/g, (_, name: string) => (names.push(name), "(.+?)"));
  return { form: new RegExp(`^${form}$`), names, polish };
}

const templates: readonly Template[] = [...KNOWN].filter(([english]) => english.includes("{")).map(templateOf);

/** The sentence in Polish; null where there is none. */
export function polishOf(sentence: string): string | null {
  const known = KNOWN.get(sentence);
  if (known !== undefined) return known;
  for (const { form, names, polish } of templates) {
    const found = form.exec(sentence);
    if (found === null) continue;
    const values = Object.fromEntries(names.map((name, index) => [name, found[index + 1] ?? ""]));
    return polish.replace(/\{(\w+)\}/g, (_, name: string) => KNOWN.get(values[name] ?? "") ?? values[name] ?? "");
  }
  // What a fault does comes behind its name.
  const [, head = "", rest = ""] = /^([^:]+): (.+)$/.exec(sentence) ?? [];
  const said = rest === "" ? null : polishOf(rest);
  return said === null ? null : `${head}: ${said}`;
}

/** In the language of the page as far as it is known; else in English, marked as English. */
export function sentence(english: string): { text: string; lang: "pl" | "en" | undefined } {
  const polish = language() === "pl" ? polishOf(english) : null;
  if (polish !== null) return { text: polish, lang: undefined };
  return { text: english, lang: "en" };
}
