import { svelte } from "@sveltejs/vite-plugin-svelte";
import { readFileSync } from "node:fs";
import { defineConfig, type Plugin } from "vite";

/** The texts of the licences of what is shipped with the page. */
function licences(packages: readonly string[]): Plugin {
  return {
    name: "licences",
    generateBundle() {
      const texts = packages.map((name) => {
        const read = (file: string) => readFileSync(new URL(`node_modules/${name}/${file}`, import.meta.url), "utf-8");
        const file = name.startsWith("@fontsource") ? "LICENSE" : "LICENSE.md";
        return `${name} ${JSON.parse(read("package.json")).version}\n\n${read(file)}`;
      });
      this.emitFile({ type: "asset", fileName: "licences.txt", source: texts.join("\n\n----\n\n") });
    },
  };
}

export default defineConfig({
  base: "./",
  plugins: [svelte(), licences(["svelte", "@fontsource/ibm-plex-sans", "@fontsource/ibm-plex-mono"])],
  build: {
    outDir: "../src/steptwin/studio/page",
    emptyOutDir: true,
    target: "es2022",
    // Nothing inline: the page is served with a content security policy that permits neither code nor data in the text.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    rolldownOptions: { checks: { pluginTimings: false } },
  },
  worker: { format: "es" },
  test: { include: ["tests/**/*.test.ts", "src/**/*.test.ts"], environment: "node" },
} as Parameters<typeof defineConfig>[0]);
