"""A chip is prepared on an open line: its rest of a line ended, its echo on, itself selected."""

from __future__ import annotations

import pytest
from chip_rig import BAUD, ChipWire
from line_rig import MemoryChannel

from steptwin.drivers.m1486.failures import NoEcho
from steptwin.drivers.m1486.wake import _Opened, wake
from steptwin.errors import Misuse
from steptwin.m1486.functions import RETURN


def test_the_chip_is_selected_with_its_echo_on_and_the_line_stays_open() -> None:
    wire = ChipWire(addresses=(3, 7))
    channel = MemoryChannel(wire)
    channel.write(b"v10")  # the rest of an earlier command
    said: list[str] = []
    wake(channel, "COM7", 7, BAUD, said.append)
    assert wire.chips[7].unit.on(RETURN)
    assert (wire.chips[7].receiver.is_listening, wire.chips[3].receiver.is_listening) == (True, False)
    assert wire.chips[7].receiver.waiting == 0
    assert [line for line in said if "→" in line and "CR" in line]  # what was sent
    channel.write(b"t80\r")
    wire.sleep(1.0)
    assert wire.chips[7].unit.flags[0]


def test_a_chip_alone_on_its_line_needs_no_address() -> None:
    wire = ChipWire(addresses=(9,))
    wake(MemoryChannel(wire), "COM7", None, BAUD)
    assert wire.chip.unit.on(RETURN)
    assert b"x9" not in b"".join(data for _, data in wire.sent)


def test_an_absent_chip_gives_no_echo() -> None:
    with pytest.raises(NoEcho, match="COM7"):
        wake(MemoryChannel(ChipWire(addresses=(9,))), "COM7", 3, BAUD)


def test_an_open_channel_is_for_threads() -> None:
    endpoint = _Opened(MemoryChannel(ChipWire()), "COM7")
    assert str(endpoint) == "COM7"
    with pytest.raises(Misuse, match="COM7 is open for a thread"):
        endpoint.connect(lambda: None).send(None)  # type: ignore[arg-type, return-value]
