import { en } from "./en";
import { pl } from "./pl";
import { texts } from "./texts.svelte";

/** Texts that several parts of the page share. */
export const t = texts(en, pl);
export { LANGUAGES, chooseLanguage, language, restoreLanguage, texts, type Language } from "./texts.svelte";
export { saidBy, sentence, type Inner, type Said } from "./messages";
export { meaningOf } from "./rows";
export { inWords } from "./words";
