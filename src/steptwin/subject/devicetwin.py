"""Parts from which a twin of a device is made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple


class DeviceTwin(NamedTuple):
    """A twin in the state in which the device is."""

    text: str
    """The description of its world."""
    files: Mapping[str, bytes]
    line: str
    """The name of its line there."""
    values: Sequence[tuple[str, float]]
    """Registers, to be written in this order."""
    enabled: Sequence[int]
    """Axes whose drives are on."""
    compared: Sequence[str]
    """Registers that both have to have alike."""
