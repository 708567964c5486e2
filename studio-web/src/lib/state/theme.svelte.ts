export type Theme = "light" | "dark";

const KEY = "steptwin.theme";

class Chosen {
  theme = $state<Theme>("light");
}

const chosen = new Chosen();

export const theme = (): Theme => chosen.theme;

export function chooseTheme(next: Theme): void {
  chosen.theme = next;
  document.documentElement.dataset.theme = next;
  localStorage.setItem(KEY, next);
}

/** That of last time, else that of the system. */
export function restoreTheme(): void {
  const kept = localStorage.getItem(KEY);
  const isDark = kept === null ? matchMedia("(prefers-color-scheme: dark)").matches : kept === "dark";
  chosen.theme = isDark ? "dark" : "light";
  document.documentElement.dataset.theme = chosen.theme;
}
