import { expect, test } from "vitest";
import { polishOf } from "./sentences";

test.each([
  ["Status of axis M3.", "Stan osi M3."],
  ["Waits. (in program order)", "Czeka. (w kolejności programu)"],
  // The sentence with more letters of its own is meant, whatever comes before it in the tables.
  ["unknown variable sped", "nieznana zmienna sped"],
  ["HOME needs a drive; OUT1 is not one", "HOME wymaga napędu; OUT1 nim nie jest"],
  // A name is no sentence, and stays.
  ["there is no label position", "nie ma etykiety position"],
  // Numbers are numbers.
  ["0 to 1 000 000 000", "0 do 1 000 000 000"],
  ["on some paths F 4 is not a multiple of 8", "na niektórych drogach F 4 nie jest wielokrotnością 8"],
  // Lists and lines, part by part.
  ["1 to 21 (line), 75 (Clear kill), 80 to 86 (flag)", "1 do 21 (linia), 75 (Clear kill), 80 do 86 (flaga)"],
  ["= is missing after speed\nwrite speed = 20", "po speed brakuje =\nzapis: speed = 20"],
  [
    "p.prg:2:1: error W110: there is no label MIAN\n  2 | JUMP MIAN\n    | ^^^^\n    = did you mean MAIN?",
    "p.prg:2:1: błąd W110: nie ma etykiety MIAN\n  2 | JUMP MIAN\n    | ^^^^\n    = czy miało być MAIN?",
  ],
  // Causes and frames.
  ["table.OUT3 became 1, which is wired to lamp.coil", "table.OUT3 zmienił się na 1, połączony z lamp.coil"],
  ["table waits at line 12 `WAITPOS`", "table czeka: linia 12 `WAITPOS`"],
  ["F12800  Forward 12 800 min. microsteps", "F12800  Forward 12 800 min. mikrokroków"],
  ["read M1_STATUS = on at rest (1)", "odczyt: M1_STATUS = włączony, postój (1)"],
])("%s", (english, polish) => {
  expect(polishOf(english)).toBe(polish);
});

test("what is not known stays as it is", () => {
  expect(polishOf("something else happened")).toBeNull();
  expect(polishOf("go to sleep, then on")).toBeNull();
  expect(polishOf("a, b: c")).toBeNull();
});
