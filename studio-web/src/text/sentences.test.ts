import { expect, test } from "vitest";
import { polishOf } from "./sentences";

test.each([
  ["Status of axis M3.", "Stan osi M3."],
  ["Waits. (in program order)", "Czeka. (w kolejności programu)"],
  ["stands at -12, position not valid", "stoi na -12, pozycja nieważna"],
  ["moves +1600 to 17600 in 0.082481 s", "jedzie +1600 do 17600 w 0.082481 s"],
  ["infeed.3 is on infeed", "infeed.3 jest na infeed"],
  ["jam1: M1 is blocked for 2 s", "jam1: M1 zablokowany na 2 s"],
  ["note: is on", "uwaga: is on"],
  [
    "M1: 2e+06 imp/s is more than the outputs give, 1e+06 imp/s",
    "M1: 2e+06 imp/s to więcej, niż dają wyjścia: 1e+06 imp/s",
  ],
])("%s", (english, polish) => {
  expect(polishOf(english)).toBe(polish);
});

test("what is not known stays as it is", () => {
  expect(polishOf("something else happened")).toBeNull();
});
