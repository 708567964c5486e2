// Values behind the lines of a program while it stands: of the names that the language server finds there.

import * as vscode from "vscode";
import { expressionOf, namesIn } from "./names";

export class InlineValues implements vscode.InlineValuesProvider {
  async provideInlineValues(
    document: vscode.TextDocument,
    viewPort: vscode.Range,
    context: vscode.InlineValueContext,
  ): Promise<vscode.InlineValue[]> {
    const [legend, tokens] = await Promise.all([
      vscode.commands.executeCommand<vscode.SemanticTokensLegend | undefined>(
        "vscode.provideDocumentSemanticTokensLegend",
        document.uri,
      ),
      vscode.commands.executeCommand<vscode.SemanticTokens | undefined>(
        "vscode.provideDocumentSemanticTokens",
        document.uri,
      ),
    ]);
    if (legend === undefined || tokens === undefined) return [];
    const last = Math.min(viewPort.end.line, context.stoppedLocation.end.line);
    return namesIn(tokens.data, legend.tokenTypes)
      .filter((name) => viewPort.start.line <= name.line && name.line <= last)
      .map((name) => {
        const range = new vscode.Range(name.line, name.start, name.line, name.start + name.length);
        const expression = expressionOf(document.languageId, document.lineAt(name.line).text, name);
        return new vscode.InlineValueEvaluatableExpression(range, expression);
      });
  }
}
