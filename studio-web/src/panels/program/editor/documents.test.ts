import type { LSPClient } from "@codemirror/lsp-client";
import { ChangeSet, EditorState } from "@codemirror/state";
import type { EditorView } from "@codemirror/view";
import { expect, test } from "vitest";
import { Documents, OpenText, between, textOf } from "./documents";
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

/** As much of a view, and of what the client keeps for it, as texts need: a page is not there. */
class StandInView {
  state: EditorState;
  unsyncedChanges: ChangeSet;

  constructor(text: string) {
    this.state = EditorState.create({ doc: text });
    this.unsyncedChanges = ChangeSet.empty(text.length);
  }

  plugin(): this {
    return this;
  }

  clear(): void {
    this.unsyncedChanges = ChangeSet.empty(this.state.doc.length);
  }

  type(insert: string): void {
    const { state, changes } = this.state.update({ changes: { from: this.state.doc.length, insert } });
    this.state = state;
    this.unsyncedChanges = this.unsyncedChanges.compose(changes);
  }
}

test("a text that was changed before its server answered is opened as it is now, and changes begin there", () => {
  const documents = new Documents({ didOpen: () => undefined } as unknown as LSPClient, {
    display: () => Promise.resolve(null),
    changed: () => undefined,
  });
  const file = open("DELAY 1\n", "DELAY 1\n");
  const view = new StandInView("DELAY 1\n");
  file.view = view as unknown as EditorView;
  documents.files.push(file);
  view.type("JUMP NOWHERE\n");
  documents.opensAnew();
  expect(file.doc.toString()).toBe("DELAY 1\nJUMP NOWHERE\n");
  expect(documents.syncFiles()).toEqual([]);
  view.type("END\n");
  const [update] = documents.syncFiles();
  expect(update?.prevDoc.toString()).toBe("DELAY 1\nJUMP NOWHERE\n");
  expect(update?.changes.apply(update.prevDoc).toString()).toBe("DELAY 1\nJUMP NOWHERE\nEND\n");
  expect(file.version).toBe(1);
});
