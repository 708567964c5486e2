/** Texts in the languages of the page. Shared ones are in en.ts and pl.ts, a panel's own in its folder. */

export type Language = "en" | "pl";
export const LANGUAGES: readonly Language[] = ["en", "pl"];

const KEY = "steptwin.language";

class Chosen {
  language = $state<Language>("en");
}

const chosen = new Chosen();

export const language = (): Language => chosen.language;

export function chooseLanguage(next: Language): void {
  chosen.language = next;
  document.documentElement.lang = next;
  localStorage.setItem(KEY, next);
}

/** That of last time, else that of the browser. */
export function restoreLanguage(): void {
  const kept = localStorage.getItem(KEY);
  const wanted = kept ?? navigator.language.slice(0, 2);
  chosen.language = wanted === "pl" ? "pl" : "en";
  document.documentElement.lang = chosen.language;
}

type Values = Readonly<Record<string, string | number>>;
export type Texts<K extends string> = Readonly<Record<K, string>>;

/** All texts of the page, for the test of their completeness. */
export const allTexts: Texts<string>[][] = [];

/** `{name}` in a text stands for a value. */
export function fill(text: string, values: Values = {}): string {
  return text.replace(/\{(\w+)\}/g, (whole, name: string) => String(values[name] ?? whole));
}

/** The function that gives a text in the language of the page: `t("stop", {axis: "M1"})`. */
export function texts<K extends string>(en: Texts<K>, pl: Texts<NoInfer<K>>): (key: K, values?: Values) => string {
  allTexts.push([en, pl]);
  return (key, values) => fill(chosen.language === "pl" ? pl[key] : en[key], values);
}
