"""The TextMate grammars, run by the tokenizer of VS Code, agree with the parsers."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

from steptwin.lsp.answers import TokenKind
from steptwin.lsp.editorsession import EditorSession
from steptwin.lsp.textmate import GRAMMARS, grammar_text
from steptwin.m1486.commands import TABLE
from steptwin.m1486.variants import variant
from steptwin.wbc.registers import PREDEFINED, REGISTERS
from steptwin.wbc.statements import COMPARISONS, FUNCTIONS, OPERATORS, STATEMENTS

ROOT = Path(__file__).parents[2]
SYNTAXES = ROOT / "editors" / "vscode" / "syntaxes"
LANGUAGES = {".prg": "wbc", ".m1486": "m1486"}
KINDS = {
    TokenKind.COMMENT: "comment",
    TokenKind.NUMBER: "constant.numeric",
    TokenKind.KEYWORD: "keyword",
    TokenKind.LABEL: "entity.name.label",
    TokenKind.OPERATOR: "keyword.operator",
}
"""What is compared, and how its scopes begin."""
WBC = [
    *(row.usage for row in STATEMENTS.values()),
    *(row.usage.lower() for row in STATEMENTS.values()),
    *(f"x = n {sign} 2" for sign in OPERATORS),
    *(f"IF n {sign} -2,5" for sign in COMPARISONS),
    *(f"SET x = {row.name}({', '.join('12'[: row.arguments])})" for row in FUNCTIONS.values()),
    *(f"{row.name}{1 if row.last else 0 if row.words else ''} = {value}" for row in REGISTERS for value in PREDEFINED),
    *(
        "IFx = 1",
        "xIF = IN1x // IF // 1",
        "#Wait OUT1//x",
        "  jump  Main2",
        "main:",
        "MOVEPTP @IF",
        "MOVELIN @ 7",
        "#n -40",
        "IN1=.5",
    ),
]


def _numbers(key: str, values: Sequence[int]) -> Iterator[str]:
    yield f"{key.lower()} {values[0]}"
    yield from (f"{key}{value} ; R{value}" for value in {values[0], values[len(values) // 2], values[-1]})


WITH_NUMBERS = [spec for spec in TABLE if spec.permitted(variant("B")) and spec.key not in ("I", "X")]
M1486 = [
    *(line for spec in WITH_NUMBERS for line in _numbers(spec.key, spec.permitted(variant("B")))),
    *(spec.key for spec in TABLE if spec.key not in ("I", "X", "@")),
    *("I2H7", "i 80 l 5", "X0", "x f", "XG", "g +", "F1 28", "C75", "C7", "C100", "C10", "T87"),
]


def _texts() -> list[tuple[str, str, str]]:
    files = sorted(path for path in (ROOT / "examples").rglob("*") if path.suffix in LANGUAGES)
    assert len(files) > 15
    found = [(str(path.relative_to(ROOT)), LANGUAGES[path.suffix], path.read_text("utf-8")) for path in files]
    return [*found, ("made.prg", "wbc", "\n".join(WBC)), ("made.m1486", "m1486", "\n".join(M1486))]


def _by_server(name: str, language: str, text: str) -> list[list[str]]:
    """For every character the kind it has, or nothing."""
    session, uri = EditorSession(), f"file:///{name}"
    session.open(uri, language, 1, text)
    analysis = session.analysis(uri)
    assert analysis is not None
    kinds = [""] * len(text)
    for token in analysis.tokens():
        kinds[token.span.start : token.span.end] = [KINDS.get(token.kind, "")] * (token.span.end - token.span.start)
    lines = analysis.lines
    return [kinds[start : lines.end(number)] for number, start in enumerate(lines.starts)]


def _kind(scopes: Sequence[str]) -> str:
    return next((kind for kind in sorted(KINDS.values(), key=len, reverse=True) if scopes and scopes[0].startswith(kind)), "")


@pytest.mark.parametrize("language", GRAMMARS)
def test_the_grammars_are_those_of_the_tables(language: str) -> None:
    """``python -m steptwin.lsp.textmate editors/vscode/syntaxes`` makes them anew."""
    assert (SYNTAXES / f"{language}.tmLanguage.json").read_text("utf-8") == grammar_text(language)


def test_every_program_has_the_tokens_of_its_parser(run_node: Callable[..., str]) -> None:
    texts = _texts()
    asked = [{"language": language, "text": text} for _, language, text in texts]
    differences = []
    for (name, language, text), found in zip(texts, json.loads(run_node("tests/tokenise.mjs", json.dumps(asked))), strict=True):
        for number, (line, wanted, tokens) in enumerate(
            zip(text.split("\n"), _by_server(name, language, text), found, strict=True), 1
        ):
            kinds = [""] * len(line)
            for start, end, scopes in tokens:
                kinds[start : min(end, len(line))] = [_kind(scopes)] * (min(end, len(line)) - start)
            shown = [(at, one, other) for at, (one, other) in enumerate(zip(kinds, wanted, strict=True)) if one != other]
            if shown:
                differences.append((name, number, line, shown))
    assert differences == []
