import { defineConfig } from "vite";

/** The scene as one classic script, for the timeline and for pictures, beside the files of the timeline. */
export default defineConfig({
  build: {
    outDir: "../src/steptwin/files/export/page",
    emptyOutDir: false,
    target: "es2022",
    copyPublicDir: false,
    lib: { entry: "src/outside/main.ts", formats: ["iife"], name: "steptwin", fileName: () => "scene.js" },
    rolldownOptions: { checks: { pluginTimings: false } },
  },
});
