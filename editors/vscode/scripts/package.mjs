// Bundles the extension and packs it: build/steptwin.vsix in the repository.

import { copyFileSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { createVSIX } from "@vscode/vsce";
import { build } from "esbuild";

const at = (path) => fileURLToPath(new URL(`../${path}`, import.meta.url));

const { metafile } = await build({
  absWorkingDir: at("."),
  entryPoints: ["src/extension.ts"],
  outfile: "dist/extension.js",
  bundle: true,
  minify: true,
  platform: "node",
  target: "node20",
  format: "cjs",
  external: ["vscode"],
  metafile: true,
});

/** The licences of the packages in the bundle. */
function licences() {
  const inputs = Object.keys(metafile.inputs).map((path) => /^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//.exec(path)?.[1]);
  const packages = [...new Set(inputs.filter((path) => path !== undefined))].sort();
  return packages.map((path) => {
    const { name, version, license } = JSON.parse(readFileSync(at(`${path}/package.json`), "utf8"));
    const file = readdirSync(at(path)).find((one) => /^licen[cs]e/i.test(one));
    if (file === undefined) throw new Error(`${path} has no licence`);
    return `${name} ${version} (${license})\n\n${readFileSync(at(`${path}/${file}`), "utf8")}`;
  });
}

writeFileSync(at("dist/licences.txt"), licences().join(`\n${"-".repeat(80)}\n`));
copyFileSync(at("../../LICENSE"), at("LICENSE"));
mkdirSync(at("../../build"), { recursive: true });
const packagePath = at("../../build/steptwin.vsix");
await createVSIX({ cwd: at("."), packagePath, dependencies: false, allowMissingRepository: true });
