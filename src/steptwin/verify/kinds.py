"""The kinds of devices that can be checked: `CHECKED`."""

from __future__ import annotations

from typing import Any

from steptwin.drivers.kinds import DRIVERS
from steptwin.errors import Misuse
from steptwin.verify.kind import CheckedKind
from steptwin.verify.m1486_kind import M1486_CHECKED
from steptwin.verify.mic488_kind import MIC488_CHECKED

CHECKED: dict[str, CheckedKind[Any]] = {kind.name: kind for kind in (MIC488_CHECKED, M1486_CHECKED)}
"""By the name of the kind."""


def checked_kind(name: str) -> CheckedKind[Any]:
    """Raises `Misuse` for a kind of device without checks."""
    try:
        return CHECKED[name]
    except KeyError:
        permitted = " or ".join(DRIVERS[one].title for one in CHECKED)
        raise Misuse(f"there are no checks of {DRIVERS[name].title}: permitted is {permitted}") from None
