/** What has the keys of the keyboard for itself. */
const CONTROLS =
  'button, input, select, textarea, a[href], summary, [contenteditable="true"], [role="button"], [role="slider"], [role="tab"], [role="separator"], [role="switch"], [role="listbox"], [role="grid"]';
const TEXTS = 'textarea, [contenteditable="true"], input:not([type]), input[type="text"], input[type="search"]';

export const isOnControl = (target: EventTarget | null): boolean =>
  target instanceof Element && target.closest(CONTROLS) !== null;
export const isInText = (target: EventTarget | null): boolean =>
  target instanceof Element && target.closest(TEXTS) !== null;

/** What a key means outside of controls: null for nothing. Escape is heard everywhere. */
export type Meaning = "stop" | "resume" | "pause" | "step" | "find" | "help" | { panel: number };

export function meaningOf(event: KeyboardEvent): Meaning | null {
  if (event.key === "Escape") return "stop";
  if (event.ctrlKey || event.altKey || event.metaKey) return null;
  if (event.key === " ") return isOnControl(event.target) ? null : "stop";
  if (isInText(event.target)) return null;
  const meanings: Record<string, Meaning> = { ".": "resume", ",": "pause", ";": "step", "/": "find", "?": "help" };
  if (event.target instanceof Element && event.target.closest('[role="application"]')) return null;
  if (/^[1-9]$/.test(event.key)) return { panel: Number(event.key) - 1 };
  return meanings[event.key] ?? null;
}
