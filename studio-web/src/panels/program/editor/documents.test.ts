import { EditorState } from "@codemirror/state";
import { expect, test } from "vitest";
import { OpenText, between, textOf } from "./documents";
import { tokensOf } from "./tokens";

const open = (inTwin: string, now: string): OpenText =>
  new OpenText("steptwin:///a/program-0.prg", "wbc", textOf(inTwin), EditorState.create({ doc: textOf(now) }));

test("the difference of two texts leaves alone what is alike at both ends", () => {
  for (const [one, other] of [
    ["", ""],
    ["a", ""],
    ["", "a\nb"],
    ["aXc", "aYYc"],
    ["aa", "aaa"],
    ["aba", "abba"],
  ] as const) {
    const changes = between(textOf(one), textOf(other));
    expect(changes.apply(textOf(one)).toString()).toBe(other);
  }
  expect(between(textOf("same"), textOf("same")).empty).toBe(true);
  let touched: unknown[] = [];
  between(textOf("END\nA\nEND"), textOf("END\nB\nEND")).iterChanges((...span) => (touched = span.slice(0, 4)));
  expect(touched).toEqual([4, 5, 4, 5]);
});

test("a line of the twin is found in a text that was changed", () => {
  const file = open("A\nB\nC", "A\nnew\nB\nC");
  expect([1, 2, 3].map((line) => file.lineHere(line))).toEqual([1, 3, 4]);
  expect([1, 3, 4].map((line) => file.lineInTwin(line))).toEqual([1, 2, 3]);
  expect(file.isChanged).toBe(true);
  file.twinHas(null);
  expect([2, 99].map((line) => file.lineHere(line))).toEqual([2, 4]);
  expect(file.isChanged).toBe(false);
});

test("changes one after another keep the line", () => {
  const file = open("A\nB", "A\nB");
  const transaction = file.state.update({ changes: { from: 0, insert: "first\n" } });
  file.state = transaction.state;
  file.changed(transaction.changes);
  expect(file.lineHere(2)).toBe(3);
});

test("a text keeps its line ends", () => {
  const state = EditorState.create({ doc: textOf("A\r\nB"), extensions: EditorState.lineSeparator.of("\r\n") });
  expect(new OpenText("u", "wbc", textOf("A\r\nB"), state).text).toBe("A\r\nB");
  expect(open("A\r\nB", "A\nB").isChanged).toBe(false);
});

test("numbers of the protocol become parts of the text", () => {
  const doc = textOf("DELAY 5\n\n  JUMP X");
  expect(tokensOf([0, 0, 5, 0, 0, 0, 6, 1, 2, 0, 2, 2, 4, 0, 0], doc)).toEqual([
    { from: 0, to: 5, type: 0 },
    { from: 6, to: 7, type: 2 },
    { from: 11, to: 15, type: 0 },
  ]);
  expect(tokensOf([9, 0, 1, 0, 0], doc)).toEqual([]);
  expect(tokensOf([2, 7, 50, 0, 0], doc)).toEqual([{ from: 16, to: 17, type: 0 }]);
});
