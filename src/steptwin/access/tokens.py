"""Tokens grant roles. Without tokens, all clients have the same role."""

from __future__ import annotations

import hmac
from collections.abc import Iterable
from dataclasses import dataclass

from steptwin.access.roles import ROLES, Role
from steptwin.errors import Misuse, Refusal

SHORTEST_TOKEN, LONGEST_TOKEN = 16, 200
"""Characters."""


@dataclass(frozen=True, slots=True)
class Token:
    """``text``: the secret; ``name``: the name of its owner, visible to other clients."""

    role: Role
    name: str
    text: str


class AccessGate:
    """Admits clients with one of the ``tokens``; without tokens, all clients with the role ``open_to``."""

    def __init__(self, tokens: Iterable[Token] = (), *, open_to: Role | None = None) -> None:
        self._tokens = tuple(tokens)
        self._open_to = open_to

    @property
    def asks(self) -> bool:
        """Whether a token is required."""
        return self._open_to is None

    def enter(self, given: str | None) -> tuple[Role, str | None]:
        """The role, and the name of the token. Raises `Refusal`."""
        found: Token | None = None
        data = (given or "").encode("utf-8", "replace")
        for token in self._tokens:  # all of them, against timing attacks
            if hmac.compare_digest(data, token.text.encode("utf-8")):
                found = token
        if found is not None:
            return found.role, found.name
        if self._open_to is not None:
            return self._open_to, None
        raise Refusal("no token: open the address with the token that the studio printed" if not given else "wrong token")


def read_tokens(text: str, place: str) -> tuple[Token, ...]:
    """A file with lines ``ROLE NAME TOKEN``; ``#`` begins a comment. Raises `Misuse`, with ``place`` and the line's number."""
    found: list[Token] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        where = f"{place}, line {number}"
        if len(words) != 3:
            raise Misuse(f"{where}: {len(words)} words: expected ROLE NAME TOKEN")
        role, name, token = words
        if role not in ROLES:
            raise Misuse(f"{where}: no role {role!r}; roles are {', '.join(ROLES)}")
        if not SHORTEST_TOKEN <= len(token) <= LONGEST_TOKEN:
            raise Misuse(f"{where}: a token of {len(token)} characters: permitted are {SHORTEST_TOKEN} to {LONGEST_TOKEN}")
        if any(token == other.text for other in found):
            raise Misuse(f"{where}: this token is there already")
        found.append(Token(ROLES[role], name, token))
    if not found:
        raise Misuse(f"{place}: no tokens: expected lines ROLE NAME TOKEN")
    return tuple(found)
