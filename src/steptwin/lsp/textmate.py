"""TextMate grammars of the program languages, from their tables: ``python -m steptwin.lsp.textmate editors/vscode/syntaxes``.

They colour a program where there is no server, and until it answers. The names of scopes follow the conventions of TextMate.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TypeAlias

from steptwin.files.textfiles import write_bytes
from steptwin.m1486.commands import LETTERS, TABLE, ArgType, takes_number
from steptwin.wbc.registers import PREDEFINED, REGISTERS
from steptwin.wbc.statements import CLOSING, FLOW, FUNCTIONS, KEYWORDS, OPENING

Pattern: TypeAlias = Mapping[str, object]
Grammar: TypeAlias = Mapping[str, object]

_START = r"(?:\$|[^\W\d])"
_INSIDE = r"[\w.?!\"'~\\`\[\]{}$]"
"""A character of a word: `steptwin.wbc.lexer`."""
_END = f"(?!{_INSIDE})"
_BLANKS = r"[ \t\v\f]"
_DIGITS = r"[0-9](?:[0-9 \t]*[0-9])?"
"""A number of the M1486, which ignores blanks."""
_NAMED = frozenset({ArgType.LINE, ArgType.FUNCTION, ArgType.FLAG, ArgType.REGISTER})
"""Arguments that are numbers of something."""


def wbc_grammar() -> Grammar:
    families = [row.name for row in REGISTERS if row.last or row.words]
    single = [row.name for row in REGISTERS if not (row.last or row.words)]
    first = f"(?i)^{_BLANKS}*"
    return _grammar(
        "WBC",
        "wbc",
        ["prg", "wbc"],
        [
            _comment("//", "double-slash.wbc"),
            _groups(
                rf"{first}(#){_BLANKS}*({_START}{_INSIDE}*)?", "keyword.control.directive.define.wbc", "entity.name.constant.wbc"
            ),
            _groups(rf"{first}({_START}{_INSIDE}*){_BLANKS}*(:)", "entity.name.label.wbc", "punctuation.separator.label.wbc"),
            _groups(rf"{first}(JUMP){_END}{_BLANKS}*({_START}{_INSIDE}*)?", "keyword.control.flow.wbc", "entity.name.label.wbc"),
            _groups(f"{first}({_any(OPENING | CLOSING | {'ELSE'})}){_END}", "keyword.control.block.wbc"),
            _groups(f"{first}({_any(FLOW)}){_END}", "keyword.control.flow.wbc"),
            _groups(f"{first}({_any(KEYWORDS)}){_END}", "keyword.other.wbc"),
            _groups(
                rf"(@){_BLANKS}*({_START}{_INSIDE}*)",
                "punctuation.definition.position.wbc",
                "variable.other.constant.position.wbc",
            ),
            _match(r"[0-9]+(?:[.,][0-9]+)?(?![\w.])", "constant.numeric.wbc"),
            _match(r"\.?[0-9][\w.]*", "invalid.illegal.number.wbc"),
            _match(rf"(?i)(?:{_any(families)}[0-9]+|{_any(single)}){_END}", "variable.language.register.wbc"),
            _match(rf"(?i){_any(PREDEFINED)}{_END}", "constant.language.wbc"),
            _match(rf"(?i){_any(FUNCTIONS)}(?={_BLANKS}*\()", "support.function.wbc"),
            _match(f"{_START}{_INSIDE}*", "variable.other.wbc"),
            _match("<=|>=|<>|<(?!<)|>(?!>)|=", "keyword.operator.comparison.wbc"),
            _match(r"&&|\|\||<<|>>|[-+*/%&|]", "keyword.operator.arithmetic.wbc"),
        ],
    )


def m1486_grammar() -> Grammar:
    keys = {spec.key for spec in TABLE}
    labels = {spec.key for spec in TABLE if spec.kind is ArgType.LABEL}
    named = {spec.key for spec in TABLE if spec.kind in _NAMED}
    values = {key: [spec.values or () for spec in TABLE if (spec.key, spec.kind) == (key, ArgType.NUMBER)] for key in named}
    numbers = [(key, str(value)) for key, found in values.items() for permitted in found for value in permitted]
    others = {spec.key for spec in TABLE if spec.kind in (ArgType.CONDITION, ArgType.ADDRESS)}
    numeric = {key for key in keys - named - labels - others if takes_number(key)}
    letters_of = {
        "keyword.control.m1486": {spec.key for spec in TABLE if spec.section == "VII.1" and spec.key not in named},
        "keyword.other.m1486": {spec.key for spec in TABLE if spec.section != "VII.1" or spec.key in named},
    }
    control, other = letters_of
    return _grammar(
        "M1486",
        "m1486",
        ["m1486"],
        [
            _comment(";", "semicolon.m1486"),
            _command(_any(labels), _DIGITS, control, "entity.name.label.m1486"),
            _groups(
                rf"(?i)(I)[ \t]*({_DIGITS})[ \t]*([HL])[ \t]*({_DIGITS})",
                control,
                "variable.other.line.m1486",
                "constant.language.level.m1486",
                "entity.name.label.m1486",
            ),
            _command("X", "[0-9A-F](?![0-9A-Z])", other, "constant.numeric.address.m1486"),
            *(_command(_plain(key[0]), _plain(key[1]), other, "constant.language.m1486") for key in sorted(keys) if len(key) > 1),
            *(
                _command(_plain(key), rf"{number}(?![ \t]*[0-9])", other, "constant.numeric.m1486")
                for key, number in sorted(numbers)
            ),
            _command(_any(named), _DIGITS, other, "variable.other.m1486"),
            *(
                _command(_any(numeric & letters), _DIGITS, scope, "constant.numeric.m1486")
                for scope, letters in letters_of.items()
            ),
            *(_match(f"(?i){_any(LETTERS & letters)}", scope) for scope, letters in letters_of.items()),
        ],
    )


def _command(letter: str, argument: str, scope: str, argument_scope: str) -> Pattern:
    return _groups(rf"(?i)({letter})[ \t]*({argument})", scope, argument_scope)


def _grammar(name: str, language: str, suffixes: list[str], patterns: list[Pattern]) -> Grammar:
    return {"name": name, "scopeName": f"source.{language}", "fileTypes": suffixes, "patterns": patterns}


def _match(pattern: str, scope: str) -> Pattern:
    return {"match": pattern, "name": scope}


def _groups(pattern: str, *scopes: str) -> Pattern:
    """The scope of each group of a pattern."""
    return {"match": pattern, "captures": {str(number): {"name": scope} for number, scope in enumerate(scopes, 1)}}


def _comment(mark: str, scope: str) -> Pattern:
    return {**_groups(f"({mark}).*$", f"punctuation.definition.comment.{scope}"), "name": f"comment.line.{scope}"}


def _any(words: Collection[str]) -> str:
    """One of some words, the longest first."""
    return f"(?:{'|'.join(_plain(word) for word in sorted(words, key=lambda word: (-len(word), word)))})"


def _plain(word: str) -> str:
    return "".join(letter if letter.isalnum() or letter in "_ " else f"\\{letter}" for letter in word)


GRAMMARS = {"wbc": wbc_grammar, "m1486": m1486_grammar}


def grammar_text(language: str) -> str:
    return json.dumps(GRAMMARS[language](), indent=2, ensure_ascii=False) + "\n"


def main(folder: str) -> None:
    for language in GRAMMARS:
        write_bytes(Path(folder) / f"{language}.tmLanguage.json", grammar_text(language).encode())


if __name__ == "__main__":
    main(*sys.argv[1:])
