// The view "Axes and pins" of the debugger: what has changed since the last stop is marked.

import * as vscode from "vscode";
import { readGroups, type Group, type Value } from "./groups";

type Row = { group: Group } | { group: Group; value: Value };

const keyOf = (group: Group, value: Value): string => `${group.controller}/${value.name}`;

export class AxesAndPins implements vscode.TreeDataProvider<Row>, vscode.DebugAdapterTrackerFactory {
  private readonly changed = new vscode.EventEmitter<void>();
  readonly onDidChangeTreeData = this.changed.event;
  private session: vscode.DebugSession | undefined;
  private groups: readonly Group[] = [];
  private before = new Map<string, string>();

  /** Follows the messages of a session: every stop and every change of a value makes the view anew. */
  createDebugAdapterTracker(session: vscode.DebugSession): vscode.DebugAdapterTracker {
    return {
      onDidSendMessage: (message: { type: string; event?: string; command?: string; success?: boolean }) => {
        const isSet = message.command === "setVariable" || message.command === "setExpression";
        if (message.event === "stopped" || (message.type === "response" && isSet && message.success))
          void this.read(session);
        if (message.event === "terminated") this.clear(session);
      },
      onExit: () => this.clear(session),
    };
  }

  private async read(session: vscode.DebugSession): Promise<void> {
    try {
      const groups = await readGroups((command, args) => session.customRequest(command, args));
      this.before = new Map(this.groups.flatMap((group) => group.values.map((one) => [keyOf(group, one), one.text])));
      this.session = session;
      this.groups = groups;
      this.changed.fire();
    } catch {
      // It runs again, or has ended: the next stop is shown.
    }
  }

  private clear(session: vscode.DebugSession): void {
    if (session !== this.session) return;
    this.session = undefined;
    this.groups = [];
    this.changed.fire();
  }

  getChildren(row?: Row): Row[] {
    if (row === undefined) return this.groups.map((group) => ({ group }));
    return "value" in row ? [] : row.group.values.map((value) => ({ group: row.group, value }));
  }

  getTreeItem(row: Row): vscode.TreeItem {
    const { group } = row;
    if (!("value" in row)) {
      const item = new vscode.TreeItem(group.name, vscode.TreeItemCollapsibleState.Expanded);
      item.id = `${group.controller}/${group.name}`;
      item.description = group.controller;
      return item;
    }
    const { value } = row;
    const item = new vscode.TreeItem(value.name);
    const before = this.before.get(keyOf(group, value));
    const hasChanged = before !== undefined && before !== value.text;
    item.id = `${group.controller}/${group.name}/${value.name}`;
    item.description = value.text;
    item.tooltip = hasChanged ? `${value.text} (before: ${before})` : value.text;
    item.iconPath = new vscode.ThemeIcon(hasChanged ? "circle-filled" : "circle-outline");
    item.contextValue = value.settable ? "settable" : "readOnly";
    return item;
  }

  async setValue(row: Row): Promise<void> {
    const session = this.session;
    if (session === undefined || !("value" in row)) return;
    const { name, text, reference } = row.value;
    const wanted = await vscode.window.showInputBox({ title: `${name} of ${row.group.controller}`, value: text });
    if (wanted === undefined) return;
    try {
      await session.customRequest("setVariable", { variablesReference: reference, name, value: wanted });
    } catch (error) {
      await vscode.window.showErrorMessage(error instanceof Error ? error.message : String(error));
    }
  }
}
