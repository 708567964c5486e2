"""Names that fit the letters that have been typed."""

from __future__ import annotations


def has_letters(text: str, letters: str) -> bool:
    """Whether the letters occur in the text in their order; case matters."""
    at = 0
    for letter in letters:
        at = text.find(letter, at) + 1
        if not at:
            return False
    return True
