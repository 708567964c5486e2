import { MEANINGS } from "./meanings";
import { language } from "./texts.svelte";

/** Words of data sheets, which are English, in Polish: values of enumerations, and names of types. What is not here stays as it is. */
export const POLISH: Readonly<Record<string, string>> = {
  ok: "w porządku",
  "drive position error": "błąd pozycji napędu",
  "program error": "błąd programu",
  "Modbus master communication error": "błąd komunikacji Modbus master",
  STOP: "STOP",
  START: "START",
  PAUSE: "PAUZA",
  off: "wyłączony",
  "on at rest": "włączony, postój",
  "velocity mode": "tryb prędkości",
  "moving to position": "jedzie do pozycji",
  "position reached": "pozycja osiągnięta",
  "position error": "błąd pozycji",
  homing: "bazowanie",
  "position correction": "korekcja pozycji",
  "stopped at limit L": "zatrzymany na krańcówce L",
  "stopped at limit R": "zatrzymany na krańcówce P",
  REAL: "REAL",
  DINT: "DINT",
  DIRECT: "DIRECT",
  TRIGGER: "TRIGGER",
  none: "brak",
  wired: "podłączone",
  "not wired": "niepodłączone",
  counts: "zliczenia",
  "counts/rev": "zliczenia/obr.",
  "imp/rev": "imp/obr.",
  rev: "obr.",
  "min. microsteps": "min. mikrokroki",
  "min. microsteps/s": "min. mikrokroki/s",
  "holding register": "rejestr",
  coil: "cewka",
  input: "wejście",
  command: "polecenie",
  switch: "0 lub 1",
  "RTU over TCP": "RTU przez TCP",
  "M1486 line": "linia M1486",
};

/** Units with a sign of their own, in every language. */
const SIGNS: Readonly<Record<string, string>> = { degree: "°" };

export function inWords(words: string): string {
  const sign = SIGNS[words];
  if (sign !== undefined) return sign;
  return language() === "pl" ? (POLISH[words] ?? MEANINGS[words] ?? words) : words;
}
