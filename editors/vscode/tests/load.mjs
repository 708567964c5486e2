// Modules of the extension in TypeScript.

import { readFileSync } from "node:fs";
import { transform } from "esbuild";

export async function load(path) {
  const { code } = await transform(readFileSync(new URL(`../${path}`, import.meta.url), "utf8"), { loader: "ts" });
  return import(`data:text/javascript,${encodeURIComponent(code)}`);
}
