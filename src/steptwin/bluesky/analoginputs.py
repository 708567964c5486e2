"""Analog inputs of a MIC488, which no register shows: its program copies them into user registers (``$R100 = AIN1``)."""

from __future__ import annotations

import keyword
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from ophyd_async.core import SignalR, StandardReadable, StandardReadableFormat

from steptwin.bluesky.signals import POLL_S, DriverBackend, metadata_of
from steptwin.drivers import AsyncMic488
from steptwin.errors import Misuse


@dataclass(frozen=True, slots=True)
class AnalogInput:
    """``register``: where the program writes it, such as ``USER_REGISTER[100]:real`` for ``$R100``. ``unit``: that of LoVal and
    HiVal in the configuration, by which the controller scales it."""

    register: str
    unit: str


class AnalogReadings(StandardReadable):
    """A signal for each of ``inputs``, by its name."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> SignalR[float]: ...

    def __init__(self, mic: AsyncMic488, place: Callable[[], str], inputs: Mapping[str, AnalogInput], name: str = "") -> None:
        """Raises `Misuse` for a name that an attribute cannot have."""
        for key in inputs:
            if not key.isidentifier() or keyword.iskeyword(key) or key.startswith("_") or hasattr(StandardReadable, key):
                raise Misuse(f"analog input {key!r}: expected a name of an attribute that devices do not have already")

        async def read(register: str) -> float:
            (value,) = (await mic.get(register)).values()
            return float(value)

        def source(register: str) -> str:
            return f"{place()}/{register}"

        with self.add_children_as_readables(StandardReadableFormat.HINTED_UNCACHED_SIGNAL):
            for key, one in inputs.items():
                backend = DriverBackend(
                    float,
                    partial(source, one.register),
                    partial(read, one.register),
                    partial(metadata_of, one.unit),
                    poll_s=POLL_S,
                )
                setattr(self, key, SignalR(backend))
        super().__init__(name)
