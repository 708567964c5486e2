"""Tokens grant roles; clients without a token have one role, or are not admitted."""

from __future__ import annotations

import hmac
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from steptwin.access.roles import ROLES, Role
from steptwin.errors import Misuse, Refusal
from steptwin.messages import Message

SHORTEST_TOKEN, LONGEST_TOKEN = 16, 200
"""Characters."""


@dataclass(frozen=True, slots=True)
class Token:
    """``text``: the secret; ``name``: the name of its owner, visible to other clients."""

    role: Role
    name: str
    text: str


WRONG_TOKEN = Message("access.wrong-token", "wrong token")
NO_TOKEN = Message(
    "access.no-token", "no token: it is in the address that the studio prints on a terminal, and in its file of tokens"
)


class AccessGate:
    """Admits clients with one of the ``tokens``. Clients without a token have the role ``open_to``, while ``is_open`` says so,
    always without it."""

    def __init__(
        self, tokens: Iterable[Token] = (), *, open_to: Role | None = None, is_open: Callable[[], bool] | None = None
    ) -> None:
        self._tokens = tuple(tokens)
        self._open_to = open_to
        self._is_open = is_open

    @property
    def asks(self) -> bool:
        """Whether a token is required at present."""
        return self._open_to is None or (self._is_open is not None and not self._is_open())

    @property
    def has_tokens(self) -> bool:
        """Whether there is a token that a client can give."""
        return bool(self._tokens)

    def enter(self, given: str | None) -> tuple[Role, str | None]:
        """The role, and the name of the token; None without one. Raises `Refusal`."""
        found: Token | None = None
        data = (given or "").encode("utf-8", "replace")
        for token in self._tokens:  # all of them, against timing attacks
            if hmac.compare_digest(data, token.text.encode("utf-8")):
                found = token
        if found is not None:
            return found.role, found.name
        if given and self._tokens:
            raise Refusal(WRONG_TOKEN())
        if self._open_to is None or self.asks:
            raise Refusal(NO_TOKEN())
        return self._open_to, None


TOKEN_LINE_HAS_OTHER_WORDS = Message("access.token-line-has-other-words", "{place}: {count} words: expected ROLE NAME TOKEN")
UNKNOWN_ROLE = Message("access.unknown-role", "{place}: no role {role!r}; roles are {names}")
TOKEN_LENGTH = Message("access.token-length", "{place}: a token of {count} characters: permitted are {least} to {most}")
TOKEN_TWICE = Message("access.token-twice", "{place}: this token is there already")
NO_TOKENS = Message("access.no-tokens", "{place}: no tokens: expected lines ROLE NAME TOKEN")


def read_tokens(text: str, place: str) -> tuple[Token, ...]:
    """A file with lines ``ROLE NAME TOKEN``; ``#`` begins a comment. Raises `Misuse`, with ``place`` and the line's number."""
    found: list[Token] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        where = f"{place}, line {number}"
        if len(words) != 3:
            raise Misuse(TOKEN_LINE_HAS_OTHER_WORDS(place=where, count=len(words)))
        role, name, token = words
        if role not in ROLES:
            raise Misuse(UNKNOWN_ROLE(place=where, role=role, names=list(ROLES)))
        if not SHORTEST_TOKEN <= len(token) <= LONGEST_TOKEN:
            raise Misuse(TOKEN_LENGTH(place=where, count=len(token), least=SHORTEST_TOKEN, most=LONGEST_TOKEN))
        if any(token == other.text for other in found):
            raise Misuse(TOKEN_TWICE(place=where))
        found.append(Token(ROLES[role], name, token))
    if not found:
        raise Misuse(NO_TOKENS(place=place))
    return tuple(found)
