// The client of the language server `steptwin lsp`.

import { LanguageClient, type LanguageClientOptions } from "vscode-languageclient/node";
import { command, showFailure } from "./command";

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

  async start(): Promise<void> {
    const run = { command: command(), args: ["lsp"] };
    this.client = new LanguageClient("steptwin", "steptwin", run, OPTIONS);
    try {
      await this.client.start();
    } catch (error) {
      await showFailure("The language server", error);
    }
  }

  async stop(): Promise<void> {
    const client = this.client;
    this.client = undefined;
    if (client?.isRunning()) await client.stop();
    await client?.dispose();
  }

  async restart(): Promise<void> {
    await this.stop();
    await this.start();
  }
}
