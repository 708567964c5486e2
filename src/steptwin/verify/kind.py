"""Checks of a kind of device: one value for each, `steptwin.verify.kinds.CHECKED`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, NamedTuple

from steptwin.drivers.kind import DeviceAddress
from steptwin.drivers.tcp import Endpoint
from steptwin.verify.check import Check, CheckNeed
from steptwin.verify.running import T


class ReadyChecks(NamedTuple, Generic[T]):
    """The checks of one device, and how to reach it."""

    checks: Sequence[Check[T]]
    talk: T
    endpoint: Endpoint
    about: Callable[[], Mapping[str, object]]
    """For the report: what the device is, after the checks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedKind(Generic[T]):
    """A kind of device that can be checked. ``unchecked``: ids of interpretations that no check decides, with the reason."""

    name: str
    """As in `steptwin.drivers.kinds.DRIVERS`."""
    unchecked: Mapping[str, str]
    prepare: Callable[[DeviceAddress, frozenset[CheckNeed], tuple[int, float] | None], ReadyChecks[T]]
    """The checks with these permissions; the tuple: an axis and how far it may move, in its units. Communicates with the device
    as far as the address leaves its variant open. Raises `Misuse`, `Refusal`, `LineFailure`."""
