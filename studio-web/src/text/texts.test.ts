import { expect, test } from "vitest";
import "./index";
import { allTexts, fill } from "./texts.svelte";

// Every panel brings texts of its own.
const panels = import.meta.glob("../panels/*/text.ts", { eager: true });

const places = (text: string) => (text.match(/\{\w+\}/g) ?? []).sort();

test("there are texts of every panel", () => {
  const folders = import.meta.glob("../panels/*/panel.ts");
  expect(Object.keys(panels).length).toBe(Object.keys(folders).length);
  expect(allTexts.length).toBe(Object.keys(panels).length + 1);
});

test("every text is there in both languages, with the same values in it", () => {
  for (const [en, pl] of allTexts) {
    expect(Object.keys(pl!).sort()).toEqual(Object.keys(en!).sort());
    for (const [key, text] of Object.entries(en!)) {
      expect(text.trim(), key).not.toBe("");
      expect(pl![key]!.trim(), key).not.toBe("");
      expect(places(pl![key]!), key).toEqual(places(text));
    }
  }
});

test("values are put into a text; what is not given stays to be seen", () => {
  expect(fill("Stop {axis}", { axis: "M1" })).toBe("Stop M1");
  expect(fill("{a} {b}", { a: 0 })).toBe("0 {b}");
});
