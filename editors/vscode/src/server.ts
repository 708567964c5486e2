// The client of the language server `steptwin lsp`.

import { workspace } from "vscode";
import { LanguageClient, type LanguageClientOptions } from "vscode-languageclient/node";
import { command, isThere, showFailure } from "./command";

// The server looks into tables, configurations and descriptions of worlds to see whether they are its own.
const OPTIONS: LanguageClientOptions = {
  documentSelector: [
    { scheme: "file", language: "wbc" },
    { scheme: "file", language: "m1486" },
    { scheme: "untitled", language: "wbc" },
    { scheme: "untitled", language: "m1486" },
    { scheme: "file", pattern: "**/*.{csv,cfg,toml}" },
  ],
};

export class Server {
  private client: LanguageClient | undefined;
  /** Starts and stops, one after the other: a client that is starting cannot be stopped. */
  private work: Promise<void> = Promise.resolve();

  start(): Promise<void> {
    return this.next(() => this.startNow());
  }

  stop(): Promise<void> {
    return this.next(() => this.stopNow());
  }

  restart(): Promise<void> {
    void this.stop();
    return this.start();
  }

  private next(step: () => Promise<void>): Promise<void> {
    this.work = this.work.then(step);
    return this.work;
  }

  private async startNow(): Promise<void> {
    if (!workspace.isTrusted) return; // a folder may bring a command of its own
    if (!isThere("The language server")) return;
    const run = { command: command(), args: ["lsp"] };
    const client = new LanguageClient("steptwin", "steptwin", run, OPTIONS);
    try {
      await client.start();
      this.client = client;
    } catch (error) {
      void showFailure("The language server", error);
    }
  }

  private async stopNow(): Promise<void> {
    const client = this.client;
    this.client = undefined;
    try {
      await client?.dispose();
    } catch {
      // Its process has ended already.
    }
  }
}
