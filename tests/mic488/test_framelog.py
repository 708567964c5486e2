"""Frames in words. The bytes are the manual's, or made from them by hand."""

from __future__ import annotations

import pytest

from steptwin.controller import MILLISECOND, Nanos
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.framelog import FrameLog
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection, RtuSlavePort, TcpSlavePort

IN_MM = ControllerConfig(axes=tuple(AxisConfig(unit=3, gear=100.0) for _ in range(4)))
NOW: Nanos = 1_234_567_890


def logged(*frames: str, units: tuple[int, ...] = (1,), tcp: bool = False) -> list[str]:
    """What is said of these frames and of the answers of MIC488s in mm to them."""
    devices = {unit: Mic488Device(IN_MM) for unit in units}
    log = FrameLog(devices)
    lines: list[FrameLine] = []
    log.sinks.append(lines.append)
    callback = log.callback("tcp-1" if tcp else "pty", tcp=tcp)
    port = TcpSlavePort(devices, on_frame=callback) if tcp else RtuSlavePort(devices, on_frame=callback)
    for number, frame in enumerate(frames):
        port.exchange(bytes.fromhex(frame), NOW + number * MILLISECOND)
    return [str(line) for line in lines]


def test_the_manuals_requests() -> None:
    assert logged("01 02 13 88 00 08 FD 62", "01 05 17 71 00 00 98 65", "01 03 27 24 00 02 8E B4") == [
        "    1.234568 s  pty     → 01 02 13 88 00 08 fd 62  read IN1 … IN8",
        "    1.234568 s  pty     ← 01 02 01 00 a1 88  read IN1 … IN8 = all off",
        "    1.235568 s  pty     → 01 05 17 71 00 00 98 65  write OUT2 = OFF",
        "    1.235568 s  pty     ← 01 05 17 71 00 00 98 65  wrote OUT2 = OFF",
        "    1.236568 s  pty     → 01 03 27 24 00 02 8e b4  read M1_POS_ACT",
        "    1.236568 s  pty     ← 01 03 04 00 00 00 00 fa 33  read M1_POS_ACT = 0 mm",
    ]


def test_a_request_alone_is_put_into_words() -> None:
    log = FrameLog({1: Mic488Device(IN_MM)})
    assert log.request(1, bytes.fromhex("05 1771 0000"), tcp=False) == "write OUT2 = OFF"


def test_values_follow_data_type() -> None:
    """M1_VMAX = 1000 mm/s by default: as REAL, then, once DATA_TYPE is 1, as DINT in pulses."""
    assert logged("000100000006010327440002", "000200000006010627100001", "000300000006010327440002", tcp=True) == [
        "    1.234568 s  tcp-1   → 00 01 00 00 00 06 01 03 27 44 00 02  read M1_VMAX",
        "    1.234568 s  tcp-1   ← 00 01 00 00 00 07 01 03 04 00 00 44 7a  read M1_VMAX = 1000 mm/s",
        "    1.235568 s  tcp-1   → 00 02 00 00 00 06 01 06 27 10 00 01  write DATA_TYPE = DINT (1)",
        "    1.235568 s  tcp-1   ← 00 02 00 00 00 06 01 06 27 10 00 01  wrote DATA_TYPE = DINT (1)",
        "    1.236568 s  tcp-1   → 00 03 00 00 00 06 01 03 27 44 00 02  read M1_VMAX",
        "    1.236568 s  tcp-1   ← 00 03 00 00 00 07 01 03 04 86 a0 00 01  read M1_VMAX = 100000 imp/s (1000 mm/s)",
    ]


def test_refusals_say_what_was_refused() -> None:
    assert logged("000100000006010323280001", tcp=True) == [
        "    1.234568 s  tcp-1   → 00 01 00 00 00 06 01 03 23 28 00 01  read 9000 (unmapped)",
        "    1.234568 s  tcp-1   ← 00 01 00 00 00 03 01 83 02  exception 02 illegal data address (9000)",
    ]


def test_units_are_named_where_there_are_several() -> None:
    said = logged("000100000006050327240002", "000200000006090327240002", units=(1, 5), tcp=True)
    assert [line.partition("  unit ")[2] for line in said] == [
        "5: read M1_POS_ACT",
        "5: read M1_POS_ACT = 0 mm",
        "9 is not served here",
        "9 is not served here",
    ]


def test_mic_23_the_other_units_of_a_single_device() -> None:
    said = logged("000100000006FF0327240002", "000200000006000327240002", tcp=True)
    assert [line.partition("  unit ")[2] for line in said] == [
        "255: read M1_POS_ACT",
        "255: read M1_POS_ACT = 0 mm",
        "0: read M1_POS_ACT",
        "0: read M1_POS_ACT = 0 mm",
    ]


@pytest.mark.parametrize("units", [(1,), (1, 2)])
def test_a_broadcast_is_put_into_words(units: tuple[int, ...]) -> None:
    assert logged("00 05 17 71 00 00 99 B4", units=units) == [
        "    1.234568 s  pty     → 00 05 17 71 00 00 99 b4  broadcast: write OUT2 = OFF"
    ]


def test_mic_2_a_broadcast_on_tcp_to_several_units_is_put_into_words() -> None:
    (said,) = logged("000100000006000517710000", units=(1, 2), tcp=True)
    assert said.endswith("broadcast: write OUT2 = OFF")


def test_frames_of_others_on_the_line_are_shown_and_not_interpreted() -> None:
    assert logged("09 03 27 24 00 02 8F FC") == ["    1.234568 s  pty     → 09 03 27 24 00 02 8f fc  unit 9 is not served here"]


@pytest.mark.parametrize("direction", list(FrameDirection))
def test_what_makes_no_sense_is_said_to(direction: FrameDirection) -> None:
    log = FrameLog({1: Mic488Device(IN_MM)})
    lines: list[FrameLine] = []
    log.sinks.append(lines.append)
    log.callback("pty", tcp=False)(NOW, direction, bytes.fromhex("01 03 00"))
    assert len(lines) == 1
