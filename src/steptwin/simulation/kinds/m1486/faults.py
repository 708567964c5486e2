"""The M1486 as something that can fail. What its shaft does is for mechanics: the chip has no encoder."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.pins import ALIASES, CONTROL_PINS, LINE_PINS, OUTPUT_PINS, known_pin, refuse_taken
from steptwin.m1486.variants import Store
from steptwin.messages import Message
from steptwin.simulation.faults.controller import AxisLoad, FaultyController
from steptwin.simulation.faults.table import FaultKind, Need, Occasion

WRONG_LEVEL = Message("simulation.m1486.wrong-level", "{pin} = {level:g}: a digital input is 0 or 1")


class M1486Body:
    """A file is of no use unless it is whole: one whose saving was cut off, or that meets a worn byte, is lost."""

    inputs = (*LINE_PINS, *CONTROL_PINS)
    outputs = (*LINE_PINS, *OUTPUT_PINS)

    def __init__(self, chip: M1486Chip, shafts: Iterable[AxisLoad] = ()) -> None:
        self._chip = chip
        self.shafts = list(shafts)

    def slip(self, axis: int, counts: int, now: Nanos) -> None:
        """There is no encoder: `lacks` says so."""

    def lacks(self, kind: FaultKind) -> str | None:
        if kind.parameter("axis") is not None and not self.shafts:
            return "has no shaft: an M1486 has one where a world has its [[axis]]"
        if kind.needs is Need.ENCODER:
            return "is an M1486, which reads no encoder"
        if kind.needs is Need.MODBUS_MASTER:
            return "is an M1486, which is not a Modbus master"
        if kind.occasion is Occasion.SAVE and self._chip.variant.store is not Store.EEPROM:
            return "saves nothing: it has no memory that survives power-off"
        return None

    def show_master_error(self, shown: bool, now: Nanos) -> None:
        """There is none."""

    def watch(self, owner: FaultyController) -> None:
        chip = self._chip
        store = chip.store
        chip.store = lambda image: _keep(chip, store, owner, image)

    def pin_name(self, pin: str) -> str:
        name = pin.strip().upper()
        return ALIASES.get(name, name)

    def check_pin(self, pin: str, level: float) -> None:
        refuse_taken(known_pin(pin), self._chip.interface)
        if level not in (0.0, 1.0):
            raise Misuse(WRONG_LEVEL(pin=pin, level=level))

    def applied(self, pin: str) -> float | None:
        line = LINE_PINS.get(pin)
        return None if line is None else float(self._chip.io.external[line])


def _keep(chip: M1486Chip, store: Callable[[bytes], bytes | None] | None, owner: FaultyController, image: bytes) -> bytes:
    size = max(len(image), len(chip.image))
    old, new = chip.image.ljust(size, b"\xff"), image.ljust(size, b"\xff")
    kept = owner.kept(old, new, chip.now)
    image = image if kept == new else chip.image if kept == old else b""
    stored = store(image) if store is not None else None
    return image if stored is None else stored
