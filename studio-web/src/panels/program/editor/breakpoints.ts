import { RangeSet, StateEffect, StateField, type Extension } from "@codemirror/state";
import { EditorView, GutterMarker, gutter, keymap, lineNumbers } from "@codemirror/view";

/** A breakpoint beside a line; ``place`` is anywhere in the line. */
export interface Mark {
  place: number;
  kind: "plain" | "conditional" | "log" | "wrong";
  /** For people: its condition, its text. */
  title: string;
}

export interface GutterEvents {
  /** A breakpoint is wanted in a line of the present text, or no more. */
  toggle(line: number): void;
  /** Its condition, hit count or text is to be given. */
  edit(line: number): void;
}

const SIGNS: Record<Mark["kind"], string> = { plain: "●", conditional: "◆", log: "✎", wrong: "○" };

class Dot extends GutterMarker {
  constructor(
    readonly kind: Mark["kind"],
    readonly title: string,
  ) {
    super();
  }

  override eq(other: Dot): boolean {
    return other.kind === this.kind && other.title === this.title;
  }

  override toDOM(): Node {
    const dot = document.createElement("span");
    dot.className = `dot ${this.kind}`;
    dot.textContent = SIGNS[this.kind];
    dot.title = this.title;
    return dot;
  }
}

/** All breakpoints of the text. */
export const marksAre = StateEffect.define<readonly Mark[]>();

const marks = StateField.define<RangeSet<Dot>>({
  create: () => RangeSet.empty,
  update(before, { changes, effects, state }) {
    const news = effects.find((effect) => effect.is(marksAre));
    if (news === undefined) return before.map(changes);
    const at = ({ place }: Mark) => state.doc.lineAt(Math.min(place, state.doc.length)).from;
    const dots = (news.value as readonly Mark[]).map((mark) => new Dot(mark.kind, mark.title).range(at(mark)));
    return RangeSet.of(dots, true);
  },
});

const SPACER = new Dot("plain", "");

type Handlers = Record<string, (view: EditorView, line: { from: number }, event: Event) => boolean>;

const lineOf = (view: EditorView, from: number) => view.state.doc.lineAt(from).number;

/** What the mouse does beside the text, in each of its columns; nothing where there are no breakpoints. */
export function handlersOf(events: GutterEvents | null): Handlers {
  if (events === null) return {};
  return {
    mousedown: (view, line, event) => {
      const { button, shiftKey } = event as MouseEvent;
      if (button !== 0) return false;
      (shiftKey ? events.edit : events.toggle)(lineOf(view, line.from));
      event.preventDefault();
      return true;
    },
    contextmenu: (view, line, event) => {
      events.edit(lineOf(view, line.from));
      event.preventDefault();
      return true;
    },
  };
}

/** Breakpoints beside the text: a click there or on the number of a line, or F9, sets and removes them; with Shift, or the other
 * button of the mouse, they are edited. */
export function breakpoints(events: GutterEvents | null): Extension {
  if (events === null) return [marks, lineNumbers(), beside({})];
  const handlers = handlersOf(events);
  const here = (act: (line: number) => void) => (view: EditorView) => {
    act(lineOf(view, view.state.selection.main.head));
    return true;
  };
  return [
    marks,
    beside(handlers),
    lineNumbers({ domEventHandlers: handlers }),
    keymap.of([{ key: "F9", run: here(events.toggle), shift: here(events.edit) }]),
  ];
}

const beside = (handlers: Handlers): Extension =>
  gutter({
    class: "cm-breakpoints",
    markers: (view) => view.state.field(marks),
    initialSpacer: () => SPACER,
    domEventHandlers: handlers,
  });
