import { en } from "./en";
import { pl } from "./pl";
import { texts } from "./texts.svelte";

/** Texts that several parts of the page share. */
export const t = texts(en, pl);
export { LANGUAGES, chooseLanguage, language, restoreLanguage, texts, type Language } from "./texts.svelte";
export type { Said } from "./messages";
export { sentence } from "./sentences";
export { inWords } from "./words";
