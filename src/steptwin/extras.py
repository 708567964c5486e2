"""Libraries that only some features need: the extras of the package."""

from __future__ import annotations

import re
from collections.abc import Sequence

from steptwin.errors import Misuse


def libraries_of(extra: str) -> list[str]:
    """The libraries of an extra as pip takes them (``aiomqtt<3``), from the metadata of the installed package."""
    from importlib.metadata import requires

    wanted = re.compile(rf"""extra == ["']{re.escape(extra)}["']""")
    return [line.partition(";")[0].strip() for line in requires("steptwin") or () if wanted.search(line)]


def missing(what: str, libraries: Sequence[str]) -> Misuse:
    """The error for a feature some of whose libraries are not installed; its message has the command that installs them."""
    one = len(libraries) == 1
    *others, last = (re.split(r"[^\w.-]", library)[0] for library in libraries)
    names = " and ".join([", ".join(others), last] if others else [last])
    install = " ".join(f'"{library}"' if re.search(r"[<>\[]", library) else library for library in libraries)
    return Misuse(
        f"{what} needs {names}, which {'is' if one else 'are'} not installed: "
        f"in a clone 'make extras' installs {'it' if one else 'them'}, elsewhere 'pip install {install}'"
    )
