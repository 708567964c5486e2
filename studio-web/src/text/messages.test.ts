import { afterAll, expect, test, vi } from "vitest";

// Other tests of this process have the real texts.
vi.resetModules();
vi.doMock("./polish.json", () => ({
  default: {
    numbers: "{a:g} {a:.3g} {b:+d} {b:04X} {c:.3f} {c} {{x}}",
    names: "{name!r} z {names!r}: {problem}",
    inner: "wewnątrz {text}",
    note: "uwaga: {note}",
    lines: "{lines:\n}",
  },
}));
const { inPolish } = await import("./messages");
afterAll(() => {
  vi.doUnmock("./polish.json");
  vi.resetModules();
});

test.each([
  [{ a: 1e7, b: 255, c: -0.5 }, "1e+07 1e+07 +255 00FF -0.500 -0.5 {x}"],
  [{ a: 0.00001234, b: 7, c: 2 }, "1.234e-05 1.23e-05 +7 0007 2.000 2 {x}"],
  [{ a: 1234.5678, b: 0, c: 1e-7 }, "1234.57 1.23e+03 +0 0000 0.000 1e-7 {x}"],
  [{ a: 100, b: 1, c: 0 }, "100 100 +1 0001 0.000 0 {x}"],
])("numbers are shown as Python formats them: %o", (values, text) => {
  expect(inPolish({ id: "numbers", values })).toBe(text);
});

test("messages in a message are translated, texts of users and from elsewhere are not", () => {
  const inner = { id: "inner", values: { text: "inner" }, text: "inside inner" };
  expect(inPolish({ id: "names", values: { name: "it's", names: ["a", "b"], problem: inner } })).toBe(
    `"it's" z 'a', 'b': wewnątrz inner`,
  );
  const elsewhere = { text: "no such file" };
  expect(inPolish({ id: "names", values: { name: "x", names: [], problem: elsewhere } })).toBe("'x' z : no such file");
});

test("a list has between its members what its format says", () => {
  expect(
    inPolish({ id: "lines", values: { lines: ["a", { id: "note", values: { note: "b" }, text: "note: b" }] } }),
  ).toBe("a\nuwaga: b");
});

test("words of a user are not translated, whatever they are like", () => {
  const note = "the chip shop waits 5 ms";
  expect(inPolish({ id: "note", values: { note } })).toBe(`uwaga: ${note}`);
});

test("a message without a translation has none", () => {
  expect(inPolish({ id: "unknown", values: {} })).toBeNull();
});
