import { StateEffect, StateField, type Extension } from "@codemirror/state";
import { Decoration, EditorView, GutterMarker, gutter, type DecorationSet } from "@codemirror/view";
import type { handlersOf } from "./breakpoints";

const NOW = Decoration.line({ class: "now", attributes: { "aria-current": "step" } });

/** The statement that is executed is at this place of the text; null while none is. */
export const runsAt = StateEffect.define<number | null>();

const place = StateField.define<DecorationSet>({
  create: () => Decoration.none,
  update(before, { changes, effects, state }) {
    const news = effects.find((effect) => effect.is(runsAt));
    if (news === undefined) return before.map(changes);
    const at = news.value as number | null;
    return at === null
      ? Decoration.none
      : Decoration.set(NOW.range(state.doc.lineAt(Math.min(at, state.doc.length)).from));
  },
  provide: (field) => EditorView.decorations.from(field),
});

class Arrow extends GutterMarker {
  override toDOM(): Node {
    return document.createTextNode("▶");
  }
}
const ARROW = new Arrow();

/** The running line, marked in the text and beside it, in a column that takes clicks as the others do. */
export const runningLine = (domEventHandlers: ReturnType<typeof handlersOf>): Extension => [
  place,
  gutter({
    class: "cm-running",
    lineMarker: (view, line) => {
      let isHere = false;
      view.state.field(place).between(line.from, line.from, (from) => {
        isHere ||= from === line.from;
      });
      return isHere ? ARROW : null;
    },
    lineMarkerChange: (update) => update.startState.field(place) !== update.state.field(place),
    initialSpacer: () => ARROW,
    domEventHandlers,
  }),
];
