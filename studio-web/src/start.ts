import { mount, unmount } from "svelte";
import App from "./App.svelte";
import "./app.css";
import "./fonts.css";
import type { Backend } from "./lib/protocol/backend";
import { restoreTheme } from "./lib/state/theme.svelte";
import { restoreLanguage } from "./text";

/** The page, with the studio behind it. */
export function start(backend: Backend): void {
  restoreLanguage();
  restoreTheme();
  const begin = () => mount(App, { target: document.getElementById("app") as HTMLElement, props: { backend } });
  // The page is not blocked by all of it at once.
  setTimeout(() => {
    let app = begin();
    backend.swapped(() => {
      void unmount(app);
      app = begin();
    });
  });
}
