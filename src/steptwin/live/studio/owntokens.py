"""The tokens of the studios of a user: in one file that only this user can read, the same for all of them and after a restart."""

from __future__ import annotations

import os
import secrets
from contextlib import suppress
from pathlib import Path

from steptwin.access.roles import Role
from steptwin.access.tokens import Token
from steptwin.errors import Misuse
from steptwin.files.tokenfiles import tokens_in
from steptwin.live.directory import private_directory
from steptwin.live.keptsettings import state_directory
from steptwin.system import reason

NAME = "tokens"
TOKEN_BYTES = 24
HEAD = "# Tokens of the studios of this user: ROLE NAME TOKEN. Without this file the next studio makes new ones.\n"


def own_tokens() -> tuple[Path, tuple[Token, ...]]:
    """The file and its tokens; made by the first studio.

    Raises `Misuse` where it cannot be kept, or other users can read it.
    """
    path = state_directory() / NAME
    if not path.exists():
        try:
            _make(path)
        except OSError as error:
            why = f"the token of this studio cannot be kept in {path}: {reason(error)}"
            raise Misuse(f"{why}: give --tokens FILE, or --open-to-local-users") from error
    return path, tokens_in(path)


def new_tokens() -> tuple[Token, ...]:
    """One for each role, the highest first."""
    return tuple(Token(role, role.title, secrets.token_urlsafe(TOKEN_BYTES)) for role in reversed(Role))


def _make(path: Path) -> None:
    """As a whole, and once: of two studios that start at the same time the second takes that of the first. Raises `OSError`."""
    private_directory(path.parent)
    fresh = path.with_name(f".{NAME}.{os.getpid()}")
    with suppress(FileNotFoundError):
        fresh.unlink()
    text = HEAD + "".join(f"{token.role.title} {token.name} {token.text}\n" for token in new_tokens())
    try:
        write_private(fresh, text)
        with suppress(FileExistsError):
            os.link(fresh, path)
    finally:
        fresh.unlink(missing_ok=True)


def write_private(path: Path, text: str) -> None:
    """A new file that only this user can read. Raises `OSError`, also where there is one."""
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
