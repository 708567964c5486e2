import { expect, test } from "vitest";
import { polishOf } from "./sentences";

test.each([
  ["Status of axis M3.", "Stan osi M3."],
  ["Waits. (in program order)", "Czeka. (w kolejności programu)"],
  ["stands at -12, position not valid", "stoi na -12, pozycja nieważna"],
  ["moves +1600 to 17600 in 0.082481 s", "jedzie +1600 do 17600 w 0.082481 s"],
  ["infeed.3 is on infeed", "infeed.3 jest na infeed"],
  ["jam1: M1 is blocked for 2 s", "jam1: M1 zablokowany na 2 s"],
  [
    "M1: 2e+06 imp/s is more than the outputs give, 1e+06 imp/s",
    "M1: 2e+06 imp/s to więcej, niż dają wyjścia: 1e+06 imp/s",
  ],
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
  ["M1_VEL = 1e+09 mm/s: permitted −40000…40000 mm/s", "M1_VEL = 1e+09 mm/s: dozwolone −40000…40000 mm/s"],
])("%s", (english, polish) => {
  expect(polishOf(english)).toBe(polish);
});

test("what is not known stays as it is", () => {
  expect(polishOf("something else happened")).toBeNull();
  expect(polishOf("go to sleep, then on")).toBeNull();
  expect(polishOf("a, b: c")).toBeNull();
});
