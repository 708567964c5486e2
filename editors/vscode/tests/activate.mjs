// Activates the bundled extension with a module "vscode" that records what is registered in it: JSON, by the name of the function.
// Everything else of that module does nothing. The workspace is not trusted, so that no process is started.

import { readFileSync } from "node:fs";
import Module from "node:module";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const registered = {};

/** Any member of the module "vscode": a class or function whose members are of the same kind. */
function anything(name, known = {}) {
  return new Proxy(class {}, {
    get: (target, key) => {
      if (key in known) return known[key];
      if (key === "prototype" || typeof key === "symbol") return target[key];
      return anything(key);
    },
    apply: (_target, _this, [id]) => {
      if (/^register/.test(name)) (registered[name] ??= []).push(id);
      return { dispose() {} };
    },
  });
}

const types = readFileSync(new URL("../node_modules/@types/vscode/index.d.ts", import.meta.url), "utf8");
const names = [...types.matchAll(/^\texport (?:class|enum|namespace|const|function) (\w+)/gm)].map(([, name]) => name);
const vscode = {
  ...Object.fromEntries(names.map((name) => [name, anything(name)])),
  version: "1.91.0",
  workspace: anything("workspace", { isTrusted: false }),
};
const load = Module._load;
Module._load = (request, ...rest) => (request === "vscode" ? vscode : load(request, ...rest));

const { outputFiles } = await build({
  absWorkingDir: fileURLToPath(new URL("..", import.meta.url)),
  entryPoints: ["src/extension.ts"],
  bundle: true,
  write: false,
  platform: "node",
  format: "cjs",
  external: ["vscode"],
});
const bundle = new Module("extension");
bundle.paths = [];
bundle._compile(outputFiles[0].text, fileURLToPath(new URL("../dist/extension.js", import.meta.url)));
bundle.exports.activate({ subscriptions: [] });
await bundle.exports.deactivate();
process.stdout.write(JSON.stringify(registered));
