import { LSPPlugin } from "@codemirror/lsp-client";
import { RangeSetBuilder, StateEffect, StateField, type Extension, type Text } from "@codemirror/state";
import { Decoration, EditorView, ViewPlugin, type DecorationSet, type ViewUpdate } from "@codemirror/view";

/** Part of a text and what it is, by the number of its type in the legend of the server. */
export interface Token {
  from: number;
  to: number;
  type: number;
}

const AFTER_TYPING_MS = 120;
const RETRY_MS = 300;

/** From the numbers of the protocol: line and column as differences to the token before, length, type, modifiers. */
export function tokensOf(data: readonly number[], doc: Text): Token[] {
  const found: Token[] = [];
  let line = 0;
  let column = 0;
  for (let at = 0; at + 4 < data.length; at += 5) {
    const [lines, columns, length, type] = data.slice(at, at + 4) as [number, number, number, number];
    line += lines;
    column = lines === 0 ? column + columns : columns;
    if (line >= doc.lines) break;
    const from = doc.line(line + 1).from + column;
    const to = Math.min(from + length, doc.length);
    if (from < to) found.push({ from, to, type });
  }
  return found;
}

const colour = StateEffect.define<DecorationSet>();
const colours = StateField.define<DecorationSet>({
  create: () => Decoration.none,
  update(before, { changes, effects }) {
    const news = effects.find((effect) => effect.is(colour));
    return news === undefined ? before.map(changes) : (news.value as DecorationSet);
  },
  provide: (field) => EditorView.decorations.from(field),
});

/** Colours by meaning, as the editor server knows it. */
export function semanticColours(): Extension {
  const plugin = ViewPlugin.fromClass(
    class {
      private timer = 0;

      constructor(private readonly view: EditorView) {
        this.later(0);
      }

      update(update: ViewUpdate): void {
        if (update.docChanged) this.later(AFTER_TYPING_MS);
      }

      destroy(): void {
        clearTimeout(this.timer);
      }

      private later(ms: number): void {
        clearTimeout(this.timer);
        this.timer = window.setTimeout(() => void this.ask(), ms);
      }

      private async ask(): Promise<void> {
        const found = LSPPlugin.get(this.view);
        if (found === null || !found.client.connected) return this.later(RETRY_MS);
        const { client, uri } = found;
        client.sync();
        const doc = this.view.state.doc;
        try {
          const answer = await client.request<object, { data: number[] } | null>("textDocument/semanticTokens/full", {
            textDocument: { uri },
          });
          if (this.view.state.doc !== doc) return; // what was typed meanwhile has asked again
          if (answer === null) return this.later(RETRY_MS);
          const legend = client.serverCapabilities?.semanticTokensProvider?.legend.tokenTypes ?? [];
          const builder = new RangeSetBuilder<Decoration>();
          for (const { from, to, type } of tokensOf(answer.data, doc)) {
            builder.add(from, to, Decoration.mark({ class: `tok-${legend[type] ?? "text"}` }));
          }
          this.view.dispatch({ effects: colour.of(builder.finish()) });
        } catch {
          this.later(RETRY_MS);
        }
      }
    },
  );
  return [colours, plugin];
}
