import { svelte } from "@sveltejs/vite-plugin-svelte";
import { readFileSync, readdirSync } from "node:fs";
import { defineConfig, type Plugin } from "vite";

/** The texts of the licences of what is shipped with the page: packages whose modules are in it, and `others`. */
function licences(others: readonly string[]): Plugin {
  return {
    name: "licences",
    generateBundle(_options, bundle) {
      const modules = Object.values(bundle).flatMap((chunk) => (chunk.type === "chunk" ? chunk.moduleIds : []));
      const found = modules.flatMap((id) => /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(id)?.[1] ?? []);
      const texts = [...new Set([...others, ...found])].sort().map((name) => {
        const folder = new URL(`node_modules/${name}/`, import.meta.url);
        const file = readdirSync(folder).find((one) => /^licen[cs]e/i.test(one));
        if (file === undefined) throw new Error(`${name} has no licence`);
        const { version } = JSON.parse(readFileSync(new URL("package.json", folder), "utf-8")) as { version: string };
        return `${name} ${version}\n\n${readFileSync(new URL(file, folder), "utf-8")}`;
      });
      this.emitFile({ type: "asset", fileName: "licences.txt", source: texts.join("\n\n----\n\n") });
    },
  };
}

export default defineConfig({
  base: "./",
  plugins: [svelte(), licences(["@fontsource/ibm-plex-sans", "@fontsource/ibm-plex-mono"])],
  build: {
    outDir: "../src/steptwin/studio/page",
    emptyOutDir: true,
    target: "es2022",
    // Nothing inline: the page is served with a content security policy that permits neither code nor data in the text.
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 600,
    modulePreload: { polyfill: false },
    rolldownOptions: { checks: { pluginTimings: false } },
  },
  worker: { format: "es" },
  // A process for each file would take four times as long.
  test: { include: ["tests/**/*.test.ts", "src/**/*.test.ts"], environment: "node", isolate: false },
} as Parameters<typeof defineConfig>[0]);
