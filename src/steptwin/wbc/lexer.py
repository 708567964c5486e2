"""The words of one line of WBC. Every character belongs to a token or is blank; nothing is ever refused here."""

from __future__ import annotations

import re
import unicodedata
from typing import NamedTuple

NUMBER = 1
WRONG_NUMBER = 2
WORD = 3
COMPARISON = 4
OPERATOR = 5
MARK = 6
"""One of ``( ) , : @ #``."""
STRANGE = 7
"""A character without a meaning in WBC."""


BLANKS = " \t\v\f"
"""Characters that separate words. Other white space, such as a no-break space, is a strange character."""


_LETTERS_WITH_STROKES = str.maketrans("łŁøØđĐ", "lLoOdD")


class Lexeme(NamedTuple):
    kind: int
    text: str
    start: int
    end: int


# The order decides: a whole number before a part of one, long operators before short ones. A comma or point followed by a
# digit is a decimal sign. A word includes characters that cannot start anything else (`a.b`, `a?`), so that the message
# names the whole word.
_TOKEN = re.compile(
    r"""
      ( [0-9]+ (?: [.,][0-9]+ )? (?! [\w.] ) )
    | ( \.?[0-9] [\w.]* )
    | ( (?: \$ | [^\W\d] ) [\w.?!"'~\\`\[\]{};$]* (?<! ; ) )
    | ( <= | >= | <> | := | != | == | =< | => | =(?!=) | <(?!<) | >(?!>) )
    | ( && | \|\| | << | >> | [-+*/%&|^] )
    | ( [(),:@#] )
    | ( [^ \t\v\f] )
    """,
    re.VERBOSE,
)


def tokens(text: str, offset: int) -> list[Lexeme]:
    """Tokens of a line without its comment. ``offset`` is where the line begins in the source."""
    return [
        Lexeme(match.lastindex or STRANGE, match[0], match.start() + offset, match.end() + offset)
        for match in _TOKEN.finditer(text)
    ]


def plain_name(text: str) -> str | None:
    """A name as WBC writes it: without accents and ``$``, with ``_`` for other signs. None if a letter has no such form."""
    plain = unicodedata.normalize("NFKD", text.removeprefix("$").translate(_LETTERS_WITH_STROKES))
    letters = "".join(char for char in plain if not unicodedata.combining(char))
    found = "".join(char if char.isalnum() else "_" for char in letters)
    return found if is_name(found) and found.strip("_") else None


def is_name(text: str) -> bool:
    """Whether a text is a name: letters without accents, digits, underscore, no digit first."""
    return text.isascii() and text.isidentifier()
