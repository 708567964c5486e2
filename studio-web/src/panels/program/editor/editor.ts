import { closeBrackets } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap } from "@codemirror/commands";
import { bracketMatching } from "@codemirror/language";
import { lintKeymap, setDiagnostics, type Action, type Diagnostic } from "@codemirror/lint";
import {
  LSPClient,
  LSPPlugin,
  findReferencesKeymap,
  formatDocument,
  formatKeymap,
  hoverTooltips,
  jumpToDefinitionKeymap,
  renameKeymap,
  renameSymbol,
  serverCompletion,
  signatureHelp,
} from "@codemirror/lsp-client";
import { highlightSelectionMatches, search, searchKeymap } from "@codemirror/search";
import { EditorState, type Extension, type Text } from "@codemirror/state";
import { EditorView, drawSelection, highlightActiveLine, keymap } from "@codemirror/view";
import type { OpenLink } from "../../../lib/protocol/backend";
import { saidBy, sentence, type Inner, type Said } from "../../../text";
import { breakpoints, handlersOf, marksAre, type GutterEvents, type Mark } from "./breakpoints";
import { between, Documents, OpenText, textOf, type Finding } from "./documents";
import { runningLine, runsAt } from "./running";
import { look } from "./theme";
import { semanticColours } from "./tokens";
import { EditorSocket } from "./transport";

/** Positions of the protocol count lines and characters from 0. */
interface Position {
  line: number;
  character: number;
}
interface Range {
  start: Position;
  end: Position;
}
interface Published {
  uri: string;
  version?: number;
  diagnostics: { range: Range; severity?: 1 | 2 | 3 | 4; code?: string; message: string; data?: Inner[] }[];
}
interface CodeAction {
  title: string;
  data?: Inner;
  diagnostics?: { range: Range; code?: string }[];
  edit?: { changes?: Record<string, { range: Range; newText: string }[]> };
}

export interface EditorEvents {
  /** The texts, or what is found in them, are others. */
  changed(): void;
  /** Whether the editor server can be asked, and why not. */
  connected(isConnected: boolean, why: string): void;
  /** What is done beside the text. */
  readonly gutter: GutterEvents;
  /** Another text has to be shown. */
  display(uri: string): Promise<void>;
}

/** Of a text, as the service lists it. */
export interface TextKind {
  readonly language: string;
  readonly has_statements: boolean;
}

const worded = ({ text, message }: Said): string => sentence(text, message).text;

const SEVERITIES = ["error", "warning", "info", "hint"] as const;
const SYNC_MS = 150;

/** One view, and all texts that are open. */
export class ProgramEditor {
  private readonly socket: EditorSocket;
  private readonly client: LSPClient;
  private readonly documents: Documents;
  private view: EditorView | null = null;
  private syncTimer = 0;
  private isOpen = false;
  private isEnding = false;

  constructor(
    openLink: OpenLink,
    private readonly phrases: Record<string, string>,
    private readonly events: EditorEvents,
  ) {
    this.client = new LSPClient({
      // The 3 s of the library are too short for a computer that has other work.
      timeout: 30_000,
      rootUri: "steptwin:///",
      workspace: (client) => {
        const display = async (uri: string) => {
          await events.display(uri);
          return this.view;
        };
        return new Documents(client, { display, changed: () => events.changed() });
      },
      notificationHandlers: {
        "textDocument/publishDiagnostics": (_client, params: Published) => {
          void this.published(params);
          return true;
        },
      },
      extensions: [
        {
          clientCapabilities: {
            textDocument: {
              publishDiagnostics: { versionSupport: true },
              codeAction: { codeActionLiteralSupport: { codeActionKind: { valueSet: ["quickfix"] } } },
              semanticTokens: { requests: { full: true }, tokenTypes: [], tokenModifiers: [], formats: ["relative"] },
            },
          },
        },
      ],
    });
    this.documents = this.client.workspace as Documents;
    this.socket = new EditorSocket(openLink, {
      opened: () => {
        this.isOpen = true;
        this.documents.opensAnew();
        this.client.connect(this.socket);
        events.connected(true, "");
      },
      closed: (why) => {
        this.isOpen = false;
        if (this.isEnding) this.socket.close();
        if (this.client.connected) this.client.disconnect();
        events.connected(false, why);
      },
    });
    this.socket.open();
  }

  get texts(): readonly OpenText[] {
    return this.documents.files;
  }

  find(uri: string): OpenText | null {
    return this.documents.getFile(uri);
  }

  /** Opens a text; `draft` is what it was changed to before. */
  add(uri: string, kind: TextKind, label: string, inTwin: string, draft: string | null, isEditable: boolean): OpenText {
    const state = EditorState.create({
      doc: textOf(draft ?? inTwin),
      extensions: [this.extensions(uri, kind, label, isEditable), lineEnds(inTwin)],
    });
    const file = new OpenText(uri, kind.language, textOf(inTwin), state);
    this.documents.add(file);
    return file;
  }

  /** Shows an open text in `root`, a shadow root: the policy of the page permits styles of rules there only. */
  show(file: OpenText, root: ShadowRoot): void {
    if (file.view !== null) return;
    this.client.sync();
    if (this.view === null) {
      this.view = new EditorView({ state: file.state, root, parent: root });
    } else {
      const before = this.documents.files.find((one) => one.view === this.view);
      const state = file.state;
      if (before !== undefined) before.state = this.view.state;
      this.view.setState(state);
    }
    this.mark(file);
  }

  /** The line of the text in the twin that is executed; null where none is. */
  runs(file: OpenText, line: number | null, follows: boolean): void {
    if (file.view === null) return;
    const at = line === null ? null : file.placeOfLine(line);
    // Who has the cursor in the text is not led away from it.
    const scroll =
      at !== null && follows && !file.view.hasFocus
        ? [EditorView.scrollIntoView(at, { y: "nearest", yMargin: 30 })]
        : [];
    file.view.dispatch({ effects: [runsAt.of(at), ...scroll] });
  }

  /** Breakpoints, by lines of the text in the twin. */
  stopsAt(file: OpenText, points: readonly (Omit<Mark, "place"> & { line: number })[]): void {
    const marks = points.map(({ line, kind, title }): Mark => ({ place: file.placeOfLine(line), kind, title }));
    file.view?.dispatch({ effects: marksAre.of(marks) });
  }

  /** What the twin has now. A text that was not changed here follows it. */
  twinHas(file: OpenText, text: string): void {
    const now: Text = textOf(text);
    if (!file.isChanged && !file.state.doc.eq(now)) this.replace(file, text);
    file.twinHas(now);
    this.events.changed();
  }

  replace(file: OpenText, text: string): void {
    this.documents.updateFile(file.uri, { changes: between(file.state.doc, textOf(text)) });
    file.twinHas(file.inTwin); // a line that both have is the same one, whatever was typed before
  }

  goTo(line: number, column: number): void {
    if (this.view === null) return;
    const { doc } = this.view.state;
    const at = doc.line(Math.min(line, doc.lines));
    const anchor = Math.min(at.from + column - 1, at.to);
    this.view.dispatch({ selection: { anchor }, effects: EditorView.scrollIntoView(anchor, { y: "center" }) });
    this.view.focus();
  }

  rename(): void {
    if (this.view !== null) renameSymbol(this.view);
  }

  format(): void {
    if (this.view !== null) formatDocument(this.view);
  }

  close(): void {
    clearTimeout(this.syncTimer);
    this.view?.destroy();
    this.isEnding = true;
    const end = () => this.socket.close();
    // The client reports an error where its first question is never answered.
    if (this.isOpen) this.client.initializing.then(end, end);
    else end();
  }

  private extensions(uri: string, kind: TextKind, label: string, isEditable: boolean): Extension {
    const gutter = kind.has_statements ? this.events.gutter : null;
    return [
      breakpoints(gutter),
      runningLine(handlersOf(gutter)),
      history(),
      drawSelection(),
      highlightActiveLine(),
      highlightSelectionMatches(),
      bracketMatching(),
      closeBrackets(),
      search({ top: true }),
      semanticColours(),
      serverCompletion({ override: true }),
      hoverTooltips(),
      signatureHelp(),
      keymap.of([
        ...defaultKeymap,
        ...historyKeymap,
        ...searchKeymap,
        ...lintKeymap,
        ...formatKeymap,
        ...renameKeymap,
        ...jumpToDefinitionKeymap,
        ...findReferencesKeymap,
      ]),
      EditorView.contentAttributes.of({ "aria-label": label, spellcheck: "false", tabindex: "0" }),
      EditorState.phrases.of(this.phrases),
      EditorState.readOnly.of(!isEditable),
      EditorView.updateListener.of((update) => {
        if (!update.docChanged) return;
        this.find(uri)?.changed(update.changes);
        clearTimeout(this.syncTimer);
        this.syncTimer = window.setTimeout(() => this.client.connected && this.client.sync(), SYNC_MS);
        this.events.changed();
      }),
      look,
      this.client.plugin(uri, kind.language),
    ];
  }

  /** What the server has found, with its fixes; what is about an older text is left out. */
  private async published(params: Published): Promise<void> {
    const file = this.find(params.uri);
    if (file === null || (params.version ?? file.version) !== file.version) return;
    file.checked = file.version;
    file.findings = params.diagnostics.map(({ range, severity, code, message, data }) => ({
      line: range.start.line + 1,
      column: range.start.character + 1,
      end: range.end,
      severity: SEVERITIES[(severity ?? 1) - 1] as Finding["severity"],
      code: code ?? "",
      lines: (data ?? [{ text: message }]).map(saidBy),
    }));
    this.mark(file);
    this.events.changed();
    if (params.diagnostics.length === 0 || file.view === null) return;
    const { doc, version } = file;
    const whole = { start: { line: 0, character: 0 }, end: { line: doc.lines, character: 0 } };
    const actions = await this.client
      .request<object, CodeAction[] | null>("textDocument/codeAction", {
        textDocument: { uri: file.uri },
        range: whole,
        context: { diagnostics: params.diagnostics, only: ["quickfix"] },
      })
      .catch(() => null);
    if (actions !== null && file.version === version) this.mark(file, actions);
  }

  private mark(file: OpenText, fixes: readonly CodeAction[] = []): void {
    const plugin = file.view === null ? null : LSPPlugin.get(file.view);
    if (file.view === null || plugin === null) return;
    const { length, lines } = file.doc;
    const at = ({ line, character }: Position): number =>
      line >= lines ? length : Math.min(file.doc.line(line + 1).from + character, file.doc.line(line + 1).to);
    const found = file.findings.map((finding): Diagnostic => {
      const start = { line: finding.line - 1, character: finding.column - 1 };
      const own = fixes.filter((fix) =>
        fix.diagnostics?.some(
          ({ range, code }) =>
            code === finding.code && range.start.line === start.line && range.start.character === start.character,
        ),
      );
      const from = plugin.unsyncedChanges.mapPos(at(start));
      const end = plugin.unsyncedChanges.mapPos(at(finding.end));
      return {
        from,
        to: Math.max(from, end),
        severity: finding.severity,
        source: finding.code,
        message: finding.lines.map(worded).join("\n"),
        actions: own.map((fix): Action => ({
          name: worded(saidBy(fix.data ?? { text: fix.title })),
          apply: () => this.apply(fix, at),
        })),
      };
    });
    file.view.dispatch(setDiagnostics(file.view.state, found));
  }

  private apply(fix: CodeAction, at: (position: Position) => number): void {
    for (const [uri, edits] of Object.entries(fix.edit?.changes ?? {})) {
      const changes = edits.map(({ range, newText }) => ({
        from: at(range.start),
        to: at(range.end),
        insert: newText,
      }));
      this.documents.updateFile(uri, { changes, userEvent: "input.fix" });
    }
  }
}

const lineEnds = (text: string): Extension => (text.includes("\r\n") ? EditorState.lineSeparator.of("\r\n") : []);
