"""Libraries that only some features need: the extras of the package."""

from __future__ import annotations

import re

from steptwin.errors import Misuse


def extras() -> list[str]:
    """Names of all extras, from the metadata of the installed package."""
    from importlib.metadata import metadata

    return metadata("steptwin").get_all("Provides-Extra") or []


def libraries_of(extra: str) -> list[str]:
    """The libraries of an extra as pip takes them (``aiomqtt<3``), from the metadata of the installed package; empty where there
    are modules only, as in a page of a browser."""
    from importlib.metadata import PackageNotFoundError, requires

    wanted = re.compile(rf"""extra == ["']{re.escape(extra)}["']""")
    try:
        lines = requires("steptwin") or ()
    except PackageNotFoundError:
        return []
    return [line.partition(";")[0].strip() for line in lines if wanted.search(line)]


def lacking(extra: str) -> list[str]:
    """Names of the libraries of an extra that are not installed."""
    from importlib.metadata import PackageNotFoundError, distribution

    names = []
    for library in libraries_of(extra):
        name = _name(library)
        try:
            distribution(name)
        except PackageNotFoundError:
            names.append(name)
    return names


def missing(what: str, extra: str) -> Misuse:
    """The error for a feature whose libraries cannot be imported; its message has the command that installs them.

    pip takes the steptwin that is installed, and adds what its extra names.
    """
    names = lacking(extra)
    state = f"which {'is' if len(names) == 1 else 'are'} not installed"
    if not names:  # installed, and broken; or it was installed before it had this extra
        names = [_name(library) for library in libraries_of(extra)] or [f"the extra {extra}"]
        state = "which could not be imported"
    *others, last = names
    return Misuse(
        f"{what} needs {' and '.join([', '.join(others), last] if others else [last])}, {state}: "
        f"in a clone 'make extras' installs what is missing, elsewhere pip install 'steptwin[{extra}]'"
    )


def _name(library: str) -> str:
    return re.split(r"[^\w.-]", library)[0]
