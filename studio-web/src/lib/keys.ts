/** What has the keys of the keyboard for itself. */
const CONTROLS =
  'button, input, select, textarea, a[href], summary, [contenteditable="true"], [role="button"], [role="slider"], [role="tab"], [role="separator"], [role="switch"], [role="listbox"], [role="grid"]';
const TEXTS =
  'textarea, [contenteditable="true"], input:not([type]), input[type="text"], input[type="search"], input[type="password"]';

export const isOnControl = (target: EventTarget | null): boolean =>
  target instanceof Element && target.closest(CONTROLS) !== null;
export const isInText = (target: EventTarget | null): boolean =>
  target instanceof Element && target.closest(TEXTS) !== null;

/** Where a key was pressed, inside of editors too. */
const originOf = (event: KeyboardEvent): EventTarget | null => event.composedPath()[0] ?? event.target;

/** So many panels have a key, a digit. */
export const NUMBERED = 9;

/** Whether the focus is in something that Escape leaves: a text, a list that may be open. */
export const isInField = (event: KeyboardEvent): boolean => {
  const target = originOf(event);
  return isInText(target) || (target instanceof Element && target.closest("select") !== null);
};

/** Buttons and pads that jog for as long as they are held are marked while they do. */
export const isHolding = (): boolean => document.querySelector("[data-held]") !== null;

/** What a key means outside of controls: null for nothing. */
export type Meaning = "stop" | "live" | "pause" | "back" | "on" | "find" | "filter" | "help" | { panel: number };

export function meaningOf(event: KeyboardEvent): Meaning | null {
  if (event.ctrlKey || event.altKey || event.metaKey) return null;
  const target = originOf(event);
  if (event.key === " ") return isOnControl(target) ? null : "stop";
  if (isInText(target)) return null;
  const meanings: Record<string, Meaning> = {
    ".": "live",
    p: "pause",
    ",": "back",
    ";": "on",
    "/": "find",
    f: "filter",
    "?": "help",
  };
  if (target instanceof Element && target.closest('[role="application"]')) return null;
  if (/^[1-9]$/.test(event.key)) return { panel: Number(event.key) - 1 };
  return meanings[event.key] ?? null;
}
