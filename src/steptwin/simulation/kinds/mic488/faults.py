"""The MIC488 as something that can fail."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.controller import Nanos
from steptwin.mic488.core import ANALOG_PINS, INPUT_PINS, OUTPUT_PINS, ControllerCore, check_pin
from steptwin.mic488.device import Mic488Device, Serving
from steptwin.mic488.encoder import Coupling
from steptwin.simulation.faults.answers import NEVER_SENT
from steptwin.simulation.faults.controller import AxisLoad, FaultyController
from steptwin.simulation.faults.table import FaultKind, Need
from steptwin.simulation.mechanics.scale import FULL_STEPS
from steptwin.wire.pdu import exception_pdu


class EncoderShaft:
    """The encoder of an axis is all there is of its mechanics."""

    def __init__(self, device: Mic488Device, axis: int) -> None:
        self._device = device
        self._axis = axis

    @property
    def period_p(self) -> int:
        return max(1, round(4 * self._device.axes[self._axis - 1].config.mot_resol / FULL_STEPS))

    def block(self, blocked: bool, now: Nanos) -> None:
        self._device.couple_encoder(self._axis, Coupling.BLOCKED if blocked else Coupling.DRIVE, now)

    def lose(self, pulses: int, now: Nanos) -> None:
        counts = self._device.axes[self._axis - 1].encoder.counts(pulses)
        self._device.turn_encoder(self._axis, -round(counts), now)


class Mic488Body:
    """``unit`` and ``line`` are those under which the controller is served. Without mechanics its encoders are all that its axes
    move."""

    inputs = (*INPUT_PINS, *ANALOG_PINS)
    outputs = (*OUTPUT_PINS, "ERR")

    def __init__(self, device: Mic488Device, unit: int, line: str = "") -> None:
        self._device = device
        self._unit = unit
        self._line = line
        self.shafts: list[AxisLoad] = [EncoderShaft(device, axis.number) for axis in device.axes]

    def slip(self, axis: int, counts: int, now: Nanos) -> None:
        self._device.turn_encoder(axis, counts, now)

    def lacks(self, kind: FaultKind) -> str | None:
        if kind.needs is not Need.MODBUS_MASTER or any(register.key == "M_STATUS" for register in self._device.registers):
            return None
        return f"has firmware {self._device.firmware.name}, which has no M_STATUS: 1.70 has"

    def show_master_error(self, shown: bool, now: Nanos) -> None:
        self._device.set_master_error(shown, now)

    def watch(self, owner: FaultyController) -> None:
        device = self._device
        device.slave = _Watched(device.slave, self._unit, self._line, owner)
        device.store = _keeping(device, device.store, owner)

    def pin_name(self, pin: str) -> str:
        return pin.upper()

    def check_pin(self, pin: str, level: float) -> None:
        check_pin(pin, level)

    def applied(self, pin: str) -> None:
        """No pin is both."""


class _Watched:
    """In front of the slave."""

    def __init__(self, slave: Serving, unit: int, line: str, owner: FaultyController) -> None:
        self._slave = slave
        self._unit = unit
        self._line = line
        self._owner = owner

    def answer(self, device: ControllerCore, pdu: bytes) -> bytes:
        refusal = self._owner.refusal(self._unit, self._line, pdu, device.now)
        if refusal is not None:
            return refusal
        answer = self._slave.answer(device, pdu)
        return exception_pdu(pdu[0], NEVER_SENT) if self._owner.after_request(device.now) else answer


def _keeping(
    device: Mic488Device, store: Callable[[bytes], bytes | None] | None, owner: FaultyController
) -> Callable[[bytes], bytes | None]:
    def keep(memory: bytes) -> bytes:
        kept = owner.kept(device.memory, memory, device.now)
        stored = store(kept) if store is not None else None
        return kept if stored is None else stored

    return keep
