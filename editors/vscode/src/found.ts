// Commands of this computer.

import { existsSync } from "node:fs";
import { delimiter, join } from "node:path";

/** Whether there is such a command: a path, or a name in PATH. */
export function isFound(name: string): boolean {
  const endings = process.platform === "win32" ? ["", ...(process.env.PATHEXT ?? ".EXE").split(";")] : [""];
  const folders = /[\\/]/.test(name) ? [""] : (process.env.PATH ?? "").split(delimiter);
  return folders.some((folder) => endings.some((ending) => existsSync(join(folder, name + ending))));
}
