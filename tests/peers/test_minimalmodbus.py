"""minimalmodbus on the pty: it reads until the pause after a frame, and may open the port anew for every call."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import minimalmodbus
import pytest
import serial
from minimalmodbus import BYTEORDER_LITTLE_SWAP as LOW_WORD_FIRST

pytestmark = pytest.mark.peers


@pytest.fixture
def instrument(serve: Callable[..., Any]) -> Iterator[minimalmodbus.Instrument]:
    with serial.Serial(str(serve("--demo").pty), baudrate=38400, timeout=60) as port:
        yield minimalmodbus.Instrument(port, 1)


def port(instrument: minimalmodbus.Instrument) -> serial.Serial:
    assert instrument.serial is not None
    return instrument.serial


def test_values_of_every_type(instrument: minimalmodbus.Instrument) -> None:
    instrument.write_float(10052, 12.5, byteorder=LOW_WORD_FIRST)
    assert instrument.read_float(10052, byteorder=LOW_WORD_FIRST) == 12.5
    assert instrument.read_register(10001) == 0
    instrument.write_register(10001, 5, functioncode=6)
    assert instrument.read_register(10001) == 5
    instrument.write_bit(6007, 1)
    assert instrument.read_bits(6000, 8, functioncode=1) == [0, 0, 0, 0, 0, 0, 0, 1]
    instrument.write_long(10100, -70000, signed=True, byteorder=LOW_WORD_FIRST)
    assert instrument.read_long(10100, signed=True, byteorder=LOW_WORD_FIRST) == -70000


def test_a_move(instrument: minimalmodbus.Instrument) -> None:
    instrument.write_bit(2000, 1)
    instrument.write_float(10084, 15.0, byteorder=LOW_WORD_FIRST)
    seen = [instrument.read_float(10020, byteorder=LOW_WORD_FIRST)]
    while instrument.read_register(10010) == 3:
        seen.append(instrument.read_float(10020, byteorder=LOW_WORD_FIRST))
    assert seen == sorted(seen)
    assert len(set(seen)) > 3
    assert instrument.read_register(10010) == 4
    assert instrument.read_float(10020, byteorder=LOW_WORD_FIRST) == 15.0


def test_refusals_are_understood(instrument: minimalmodbus.Instrument) -> None:
    port(instrument).timeout = 2.0  # a refusal is shorter than what it waits for
    with pytest.raises(minimalmodbus.IllegalRequestError, match="address"):
        instrument.read_register(9000)
    with pytest.raises(minimalmodbus.IllegalRequestError, match="value"):
        instrument.write_register(10000, 2, functioncode=6)


def test_the_port_opened_anew_for_every_call(instrument: minimalmodbus.Instrument) -> None:
    port(instrument).close()
    instrument.close_port_after_each_call = True
    for number in range(100):
        instrument.write_register(5, number, functioncode=6)
        assert instrument.read_register(5) == number
