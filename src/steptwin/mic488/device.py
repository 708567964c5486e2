"""The MIC488 as a pure machine: the controller with its Modbus face, and snapshots of it."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from steptwin.controller import MILLISECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.core import NO_BANKS, ControllerCore
from steptwin.mic488.program_banks import BankContents, LoadedProgram
from steptwin.mic488.registers import DEFAULT_FIRMWARE
from steptwin.mic488.slave import slave
from steptwin.state import Plain
from steptwin.wbc.interpreter import STATEMENT_TIME
from steptwin.wbc.positions import PositionTable
from steptwin.wire.pdu import DEVICE_FAILURE, exception_pdu


@dataclass(frozen=True, slots=True)
class ControllerSnapshot:
    """All state of a controller at a moment, with configuration, firmware and banks. It can be pickled; profiles are shared."""

    config: ControllerConfig
    firmware: str
    state: Plain
    banks: BankContents


PAUSE_INSIDE_A_REQUEST = Message(
    "mic488.pause-inside-a-request",
    "a request had a pause of {pause:.1f} ms inside: the controller drops a frame at 0.75 ms (MIC-15)",
)


def pause_callback(devices: Mapping[int, Mic488Device]) -> Callable[[int, Nanos], None]:
    """For ports that serve ``devices``: an event for a request with a pause inside (unit, 0 for all; pause in ns), see MIC-15."""

    def callback(unit: int, pause: Nanos) -> None:
        text = PAUSE_INSIDE_A_REQUEST(pause=pause / MILLISECOND)
        for device in devices.values() if unit == 0 else (devices[unit],):
            device.event("frame-pause", text, device.now)

    return callback


class Serving(Protocol):
    """Serves the requests of a controller: its `Slave`, or a wrapper of that."""

    def answer(self, device: ControllerCore, pdu: bytes) -> bytes: ...


REQUEST_FAILED = Message("mic488.request-failed", "request {request} failed, please report it: {what}")
SNAPSHOT_OF_OTHER_FIRMWARE = Message(
    "mic488.snapshot-of-other-firmware", "the snapshot is of firmware {firmware}, this controller has {own}"
)
SNAPSHOT_OF_OTHER_CONFIGURATION = Message(
    "mic488.snapshot-of-other-configuration", "the snapshot is of a controller with another configuration"
)


class Mic488Device(ControllerCore):
    """One controller. Commands and inputs are applied after everything that is due at their moment.

    Hooks besides those of `ControllerCore`: ``slave`` serves the requests. ``lenient`` lets masters read holes and write-only
    registers (MIC-3). The rest as in `ControllerCore`.
    """

    FIXED = ("lenient", "slave")
    __slots__ = (*FIXED,)

    def __init__(
        self,
        config: ControllerConfig,
        firmware: str = DEFAULT_FIRMWARE,
        *,
        lenient: bool = False,
        memory: bytes | None = None,
        programs: Mapping[int, LoadedProgram] = NO_BANKS,
        positions: Mapping[int, PositionTable] = NO_BANKS,
        statement_time: Nanos = STATEMENT_TIME,
    ) -> None:
        self.lenient = lenient
        self.slave: Serving = slave(firmware, lenient=lenient)
        super().__init__(config, firmware, memory=memory, programs=programs, positions=positions, statement_time=statement_time)

    # ------------------------------------------------------------------ the Modbus face

    def execute(self, pdu: bytes, now: Nanos) -> bytes:
        """Apply a request at ``now`` and answer it; a request that cannot be served is answered with its exception.

        One that fails unexpectedly is answered with exception 04, device failure, and an event.
        """
        due = self._due
        if now >= self.now and (due is None or due > now):
            self.now = now  # as `advance` where nothing is due
        else:
            self.advance(now)
        try:
            return self.slave.answer(self, pdu)
        except Exception as error:  # noqa: BLE001 - a master waits for an answer
            at = traceback.extract_tb(error.__traceback__)[-1]
            what = f"{type(error).__name__}: {error} ({at.filename}:{at.lineno})"
            self.event("internal-error", REQUEST_FAILED(request=pdu.hex(" "), what=what), now)
            self._propagate()
            return exception_pdu(pdu[0] if pdu else 0, DEVICE_FAILURE)

    # ------------------------------------------------------------------ snapshots

    def snapshot(self) -> ControllerSnapshot:
        """All state at the present moment; hooks are not part of it."""
        return ControllerSnapshot(self.config, self.firmware.name, self.copy_state(), self.program.banks.contents())

    def restore(self, snapshot: ControllerSnapshot) -> None:
        """Take the state of a snapshot, its moment and the contents of its banks too. `Misuse` when it is of another
        configuration or firmware."""
        if snapshot.firmware != self.firmware.name:
            raise Misuse(SNAPSHOT_OF_OTHER_FIRMWARE(firmware=snapshot.firmware, own=self.firmware.name))
        if snapshot.config != self.config:
            raise Misuse(SNAPSHOT_OF_OTHER_CONFIGURATION())
        self.program.banks.restore(snapshot.banks)
        self.set_state(snapshot.state)
        self.changed()
