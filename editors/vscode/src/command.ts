// The command steptwin: that of the setting, of an environment in the workspace, or the one in PATH.

import { existsSync } from "node:fs";
import { join, resolve } from "node:path";
import { commands, window, workspace } from "vscode";
import { isFound } from "./found";

const IN_ENVIRONMENT = process.platform === "win32" ? "Scripts\\steptwin.exe" : "bin/steptwin";

export function command(): string {
  const folders = (workspace.workspaceFolders ?? []).map((folder) => folder.uri.fsPath);
  const given = workspace.getConfiguration("steptwin").get("command", "").trim();
  if (given) {
    const path = given.replace("${workspaceFolder}", folders[0] ?? "");
    return /[\\/]/.test(path) ? resolve(folders[0] ?? "", path) : path;
  }
  return folders.map((folder) => join(folder, ".venv", IN_ENVIRONMENT)).find(existsSync) ?? "steptwin";
}

/** Whether the command is there; otherwise it is said. */
export function isThere(what: string): boolean {
  const there = isFound(command());
  if (!there) void showFailure(what, "there is no such command");
  return there;
}

/** Says that the command did not start, and offers the setting. */
export async function showFailure(what: string, error: unknown): Promise<void> {
  const settings = "Open the setting";
  const reason = error instanceof Error ? error.message : String(error);
  const text = `${what} (${command()}) does not start: ${reason}. The setting steptwin.command has its path.`;
  if ((await window.showErrorMessage(text, settings)) === settings)
    await commands.executeCommand("workbench.action.openSettings", "steptwin.command");
}
