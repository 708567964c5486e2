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

/** That of last time, else that of the system, also when it changes. */
export function restoreTheme(): void {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const show = (): void => {
    const kept = localStorage.getItem(KEY);
    chosen.theme = (kept === null ? system.matches : kept === "dark") ? "dark" : "light";
    document.documentElement.dataset.theme = chosen.theme;
  };
  system.addEventListener("change", show);
  show();
}
