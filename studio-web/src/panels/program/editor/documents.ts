import { LSPPlugin, Workspace, type LSPClient, type WorkspaceFile } from "@codemirror/lsp-client";
import { ChangeSet, Text, type EditorState, type TransactionSpec } from "@codemirror/state";
import type { EditorView } from "@codemirror/view";
import type { Said } from "../../../text";

type Update = ReturnType<Workspace["syncFiles"]>[number];

/** Something that the checker has found, lines and columns from 1. */
export interface Finding {
  line: number;
  column: number;
  /** Of the protocol, from 0. */
  end: { line: number; character: number };
  severity: "error" | "warning" | "info" | "hint";
  code: string;
  /** What is wrong, and what is permitted. */
  lines: readonly Said[];
}

/** A text that is open: it stays open while another one is shown. */
export class OpenText implements WorkspaceFile {
  version = 0;
  /** As the server knows it. */
  doc: Text;
  view: EditorView | null = null;
  findings: readonly Finding[] = [];
  /** The version that was checked last. */
  checked = -1;
  /** What was done to the text in the twin to get the present one. */
  private sinceTwin: ChangeSet;

  constructor(
    readonly uri: string,
    readonly languageId: string,
    /** As it is in the twin. */
    public inTwin: Text,
    private kept: EditorState,
  ) {
    this.doc = kept.doc;
    this.sinceTwin = between(inTwin, kept.doc);
  }

  get state(): EditorState {
    return this.view?.state ?? this.kept;
  }

  set state(state: EditorState) {
    this.kept = state;
  }

  /** With the line ends that it has in the twin. */
  get text(): string {
    return this.state.doc.sliceString(0, undefined, this.state.lineBreak);
  }

  /** Whether `findings` are of the present text. */
  get isChecked(): boolean {
    return this.checked === this.version && this.state.doc.eq(this.doc);
  }

  get isChanged(): boolean {
    return !this.state.doc.eq(this.inTwin);
  }

  getView(): EditorView | null {
    return this.view;
  }

  changed(changes: ChangeSet): void {
    this.sinceTwin = this.sinceTwin.compose(changes);
  }

  /** The twin has another text; null: the present one. */
  twinHas(text: Text | null): void {
    this.inTwin = text ?? this.state.doc;
    this.sinceTwin = between(this.inTwin, this.state.doc);
  }

  /** Where a line of the text in the twin, from 1, begins in the present one. */
  placeOfLine(line: number): number {
    const from = this.inTwin.line(Math.min(Math.max(line, 1), this.inTwin.lines)).from;
    return this.sinceTwin.mapPos(from, 1);
  }

  /** The line of the text in the twin, from 1, of one in the present text. */
  lineInTwin(line: number): number {
    const { doc } = this.state;
    const from = doc.line(Math.min(Math.max(line, 1), doc.lines)).from;
    const there = this.sinceTwin.invertedDesc.mapPos(from, 1);
    return this.inTwin.lineAt(Math.min(there, this.inTwin.length)).number;
  }

  /** The line in the present text, from 1, of one in the twin. */
  lineHere(line: number): number {
    const { doc } = this.state;
    return doc.lineAt(Math.min(this.placeOfLine(line), doc.length)).number;
  }
}

/** Texts of CodeMirror know no carriage returns. */
export const textOf = (text: string): Text => Text.of(text.split(/\r\n|\r|\n/));

/** All of one text for all of another one, but for what is alike at both ends. */
export function between(one: Text, other: Text): ChangeSet {
  const [a, b] = [one.toString(), other.toString()];
  let begin = 0;
  while (begin < a.length && begin < b.length && a[begin] === b[begin]) begin++;
  let end = 0;
  while (end < a.length - begin && end < b.length - begin && a[a.length - 1 - end] === b[b.length - 1 - end]) end++;
  if (begin === a.length && begin === b.length) return ChangeSet.empty(a.length);
  return ChangeSet.of({ from: begin, to: a.length - end, insert: b.slice(begin, b.length - end) }, a.length);
}

/** The open texts, as the client of the editor server asks for them. `changed` is called after a change to one without a view. */
export class Documents extends Workspace {
  files: OpenText[] = [];

  constructor(
    client: LSPClient,
    private readonly events: { display(uri: string): Promise<EditorView | null>; changed(): void },
  ) {
    super(client);
  }

  override getFile(uri: string): OpenText | null {
    return this.files.find((file) => file.uri === uri) ?? null;
  }

  add(file: OpenText): void {
    this.files.push(file);
    this.client.didOpen(file);
  }

  /** A server that knows nothing yet gets every text as it is now, without the changes since an earlier server. */
  opensAnew(): void {
    for (const file of this.files) {
      file.doc = file.state.doc;
      if (file.view !== null) LSPPlugin.get(file.view)?.clear();
    }
  }

  syncFiles(): readonly Update[] {
    const found: Update[] = [];
    for (const file of this.files) {
      const plugin = file.view === null ? null : LSPPlugin.get(file.view);
      const now = file.state.doc;
      if (plugin === null && now === file.doc) continue;
      const changes = plugin?.unsyncedChanges ?? between(file.doc, now);
      if (changes.empty) continue;
      found.push({ file, prevDoc: file.doc, changes });
      file.doc = now;
      file.version++;
      plugin?.clear();
    }
    return found;
  }

  openFile(uri: string, _languageId: string, view: EditorView): void {
    const file = this.getFile(uri);
    if (file !== null) file.view = view;
  }

  closeFile(uri: string, view: EditorView): void {
    const file = this.getFile(uri);
    if (file?.view === view) file.view = null;
  }

  override updateFile(uri: string, update: TransactionSpec): void {
    const file = this.getFile(uri);
    if (file === null) return;
    if (file.view !== null) {
      file.view.dispatch(update);
      return;
    }
    const transaction = file.state.update(update);
    file.state = transaction.state;
    file.changed(transaction.changes);
    this.client.sync();
    this.events.changed();
  }

  override displayFile(uri: string): Promise<EditorView | null> {
    return this.events.display(uri);
  }
}
