"""The M1486 as something that can fail. What its shaft does is for mechanics: the chip has no encoder."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486
from steptwin.m1486.pins import ALIASES, known_pin
from steptwin.m1486.variants import Store
from steptwin.machine import Nanos
from steptwin.world.faults.machine import FaultyMachine, Shaft
from steptwin.world.faults.table import Kind, Need, Occasion


class M1486Body:
    """A file is of no use unless it is whole: one whose saving was cut off, or that meets a worn byte, is gone."""

    def __init__(self, chip: M1486, shafts: Iterable[Shaft] = ()) -> None:
        self._chip = chip
        self.shafts = list(shafts)

    def lacks(self, kind: Kind) -> str | None:
        if kind.parameter("axis") is not None and not self.shafts:
            return "has no shaft: an M1486 has one where a world has its [[axis]]"
        if kind.needs is Need.ENCODER:
            return "is an M1486, which reads no encoder"
        if kind.needs is Need.MODBUS_MASTER:
            return "is an M1486, which is no Modbus master"
        if kind.occasion is Occasion.SAVE and self._chip.variant.store is not Store.EEPROM:
            return "saves nothing: it has no memory that survives power-off"
        return None

    def show_master_error(self, shown: bool, now: Nanos) -> None:
        """There is none."""

    def watch(self, owner: FaultyMachine) -> None:
        chip = self._chip
        store = chip.store
        chip.store = lambda image: _keep(chip, store, owner, image)

    def pin_name(self, pin: str) -> str:
        name = pin.strip().upper()
        return ALIASES.get(name, name)

    def check_pin(self, pin: str, level: float) -> None:
        known_pin(pin)
        if level not in (0.0, 1.0):
            raise Misuse(f"{pin} = {level:g}: a digital input is 0 or 1")


def _keep(chip: M1486, store: Callable[[bytes], bytes | None] | None, owner: FaultyMachine, image: bytes) -> bytes:
    size = max(len(image), len(chip.image))
    old, new = chip.image.ljust(size, b"\xff"), image.ljust(size, b"\xff")
    kept = owner.kept(old, new, chip.now)
    image = image if kept == new else chip.image if kept == old else b""
    stored = store(image) if store is not None else None
    return image if stored is None else stored
