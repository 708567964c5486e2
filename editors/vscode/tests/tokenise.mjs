// Tokens of texts by the TextMate grammars: JSON in, a list of {language, text}; JSON out, for each its lines, for each line its
// tokens [start, end, scopes].

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const require = createRequire(import.meta.url);
const textmate = require("vscode-textmate");
const oniguruma = require("vscode-oniguruma");

await oniguruma.loadWASM(readFileSync(require.resolve("vscode-oniguruma/release/onig.wasm")));
const registry = new textmate.Registry({
  onigLib: Promise.resolve({
    createOnigScanner: (patterns) => new oniguruma.OnigScanner(patterns),
    createOnigString: (text) => new oniguruma.OnigString(text),
  }),
  loadGrammar: async (scope) => {
    const file = new URL(`../syntaxes/${scope.replace("source.", "")}.tmLanguage.json`, import.meta.url);
    return textmate.parseRawGrammar(readFileSync(file, "utf8"), file.pathname);
  },
});

const result = [];
for (const { language, text } of JSON.parse(readFileSync(0, "utf8"))) {
  const grammar = await registry.loadGrammar(`source.${language}`);
  let stack = textmate.INITIAL;
  result.push(
    text.split("\n").map((line) => {
      const found = grammar.tokenizeLine(line, stack);
      stack = found.ruleStack;
      return found.tokens.map(({ startIndex, endIndex, scopes }) => [startIndex, endIndex, scopes.slice(1)]);
    }),
  );
}
process.stdout.write(JSON.stringify(result));
