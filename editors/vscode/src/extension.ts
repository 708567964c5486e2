// The extension: starts the language server, the debugger and the view of axes and pins.

import * as vscode from "vscode";
import { AxesAndPins } from "./axesAndPins";
import { Adapter, Configurations, debugProgram, LANGUAGES, TYPE } from "./debugger";
import { InlineValues } from "./inlineValues";
import { Server } from "./server";

let server: Server | undefined;

export function activate(context: vscode.ExtensionContext): void {
  const axesAndPins = new AxesAndPins();
  const started = new Server();
  server = started;
  context.subscriptions.push(
    vscode.debug.registerDebugAdapterDescriptorFactory(TYPE, new Adapter()),
    vscode.debug.registerDebugConfigurationProvider(TYPE, new Configurations()),
    vscode.debug.registerDebugAdapterTrackerFactory(TYPE, axesAndPins),
    vscode.window.registerTreeDataProvider("steptwin.axesAndPins", axesAndPins),
    vscode.languages.registerInlineValuesProvider(LANGUAGES, new InlineValues()),
    vscode.commands.registerCommand("steptwin.debugProgram", debugProgram),
    vscode.commands.registerCommand("steptwin.setValue", (row) => axesAndPins.setValue(row)),
    vscode.commands.registerCommand("steptwin.restartServer", () => started.restart()),
    vscode.workspace.onDidGrantWorkspaceTrust(() => started.start()),
    vscode.workspace.onDidChangeConfiguration((change) => {
      if (change.affectsConfiguration("steptwin.command")) void started.restart();
    }),
  );
  void started.start();
}

export async function deactivate(): Promise<void> {
  await server?.stop();
}
