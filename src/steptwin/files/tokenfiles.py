"""Files of tokens: a secret is taken only from a file that other users of the computer cannot read."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from steptwin.access.tokens import Token, read_tokens
from steptwin.errors import Misuse
from steptwin.inputfiles import MOST_BYTES, open_regular
from steptwin.system import is_own, user
from steptwin.textcodec import decode

OF_OTHERS, OF_ALL = 0o077, 0o027
"""Permissions that must not be given by a file of this user, and by one of the administrator for a service and its group."""


def tokens_in(path: Path) -> tuple[Token, ...]:
    """The tokens in a file with lines ``ROLE NAME TOKEN``.

    Raises `Misuse` for what cannot be read or is not such a file, and for a file that other users can read or write.
    """
    with open_regular(path, MOST_BYTES) as file:
        found = os.fstat(file.fileno())
        data = file.read(MOST_BYTES)
    mode = stat.S_IMODE(found.st_mode)
    is_of_administrator = found.st_uid == 0 and not is_own(found)
    if user() is not None and mode & (OF_ALL if is_of_administrator else OF_OTHERS):
        raise Misuse(f"{path}: other users can read or change these tokens (mode {mode:04o}): chmod 600 {path}")
    return read_tokens(decode(data, str(path)).text, str(path))
