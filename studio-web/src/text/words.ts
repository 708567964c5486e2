import rows from "./rows.json";
import { language } from "./texts.svelte";

/** Words of data sheets, which are English, in Polish: values of enumerations, and names of types. What is not here stays as it is. */
export const POLISH: Readonly<Record<string, string>> = rows.words;

/** Units with a sign of their own, in every language. */
const SIGNS: Readonly<Record<string, string>> = { degree: "°" };

export function inWords(words: string): string {
  const sign = SIGNS[words];
  if (sign !== undefined) return sign;
  return language() === "pl" ? (POLISH[words] ?? words) : words;
}
