import { mount } from "svelte";
import App from "./App.svelte";
import "./app.css";
import "./fonts.css";
import { served } from "./lib/protocol/served";
import { restoreTheme } from "./lib/state/theme.svelte";
import { restoreLanguage } from "./text";

restoreLanguage();
restoreTheme();
mount(App, { target: document.getElementById("app") as HTMLElement, props: { backend: served } });
