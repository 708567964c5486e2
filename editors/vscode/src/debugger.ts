// The debug adapter `steptwin dap`.

import * as vscode from "vscode";
import { command, isThere } from "./command";

export const TYPE = "steptwin";
export const LANGUAGES = ["wbc", "m1486"];

export class Adapter implements vscode.DebugAdapterDescriptorFactory {
  createDebugAdapterDescriptor(session: vscode.DebugSession): vscode.DebugAdapterDescriptor {
    // Names of files in a configuration begin at the folder of the workspace.
    const cwd = session.workspaceFolder?.uri.fsPath;
    return new vscode.DebugAdapterExecutable(command(), ["dap"], cwd === undefined ? {} : { cwd });
  }
}

export class Configurations implements vscode.DebugConfigurationProvider {
  /** Without a launch.json the program in the editor is debugged. VS Code says nothing of a command that is not there. */
  resolveDebugConfiguration(
    _folder: vscode.WorkspaceFolder | undefined,
    configuration: vscode.DebugConfiguration,
  ): vscode.DebugConfiguration | undefined {
    if (!isThere("The debugger")) return undefined;
    if (configuration.type || configuration.request) return configuration;
    const document = vscode.window.activeTextEditor?.document;
    return document !== undefined && LANGUAGES.includes(document.languageId) ? launchOf(document.uri) : undefined;
  }
}

export async function debugProgram(uri: vscode.Uri | undefined): Promise<void> {
  const program = uri ?? vscode.window.activeTextEditor?.document.uri;
  if (program !== undefined)
    await vscode.debug.startDebugging(vscode.workspace.getWorkspaceFolder(program), launchOf(program));
}

function launchOf(program: vscode.Uri): vscode.DebugConfiguration {
  return { type: TYPE, request: "launch", name: "Program", program: program.fsPath, stopOnEntry: true };
}
