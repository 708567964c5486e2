"""The interface of checks to a kind of device: one `CheckedKind` for each, `steptwin.verify.kinds.CHECKED`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
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


class CheckedKind(ABC, Generic[T]):
    """A kind of device that can be checked. Each kind is one object of one class."""

    @property
    @abstractmethod
    def name(self) -> str:
        """As in `steptwin.drivers.kinds.DRIVERS`."""

    @property
    @abstractmethod
    def unchecked(self) -> Mapping[str, str]:
        """Ids of assumptions that no check decides, with the reason."""

    @abstractmethod
    def prepare(self, address: DeviceAddress, permitted: frozenset[CheckNeed], move: tuple[int, float] | None) -> ReadyChecks[T]:
        """The checks with these permissions. ``move``: an axis and how far it may move, in its units. Communicates with the
        device as far as the address leaves its variant open. Raises `Misuse`, `Refusal`, `LineFailure`."""
