"""Captures of frames, read by Wireshark's own program."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

from steptwin.controller import MILLISECOND, SECOND
from steptwin.files.export import write_trace
from steptwin.simulation.scheduler.trace import Trace, TraceRecord
from steptwin.wire.pcapng import is_modbus_tcp

READ_TCP = bytes.fromhex("000100000006 01 03 2724 0002".replace(" ", ""))
ANSWER_TCP = bytes.fromhex("000100000007 01 03 04 41a00000".replace(" ", ""))
READ_RTU = bytes.fromhex("0103272400028ebc")
EXCEPTION_RTU = bytes.fromhex("018302c0f1")


def capture(path: Path) -> Path:
    trace = Trace(["bus"])
    frames = [
        ("tcp-1/in", READ_TCP),
        ("tcp-1/out", ANSWER_TCP),
        ("tcp-1/in", READ_TCP),
        ("pty/in", READ_RTU),
        ("pty/out", EXCEPTION_RTU),
    ]
    for number, (subject, data) in enumerate(frames):
        trace.add(TraceRecord(2 * SECOND + number * MILLISECOND, "bus", "frame", subject, data))
    (written,) = write_trace(trace, path)
    return written


def fields(tshark: str, path: Path, *names: str, options: tuple[str, ...] = ()) -> list[list[str]]:
    wanted = [part for name in names for part in ("-e", name)]
    done = subprocess.run(
        [tshark, "-r", str(path), *options, "-T", "fields", *wanted], capture_output=True, text=True, check=True
    )
    return [line.split("\t") for line in done.stdout.splitlines()]


def test_wireshark_decodes_modbus_tcp(tmp_path: Path, require_peer: Callable[[str], str]) -> None:
    path = capture(tmp_path / "x.pcapng")
    found = fields(require_peer("tshark"), path, "frame.time_epoch", "mbtcp.trans_id", "modbus.func_code", "tcp.analysis.flags")
    assert [row[1:3] for row in found[:3]] == [["1", "3"]] * 3
    assert [float(row[0]) for row in found] == [2.0, 2.001, 2.002, 2.003, 2.004]
    assert not any(row[3] for row in found if len(row) > 3), "no packet is lost or sent again"


def test_wireshark_decodes_what_went_over_a_serial_line(tmp_path: Path, require_peer: Callable[[str], str]) -> None:
    path = capture(tmp_path / "x.pcapng")
    as_rtu = ("-d", "rtacser.data,mbrtu")
    found = fields(require_peer("tshark"), path, "rtacser.eventtype", "modbus.func_code", "modbus.exception_code", options=as_rtu)
    assert [row[1] for row in found[3:]] == ["3", "3"]
    assert found[4][2] == "2"


def test_what_went_over_a_serial_line_is_stamped_at_its_end(tmp_path: Path) -> None:
    """DATA_TX_END (3) of the master and DATA_RX_END (4), after the moment in s and µs."""
    data = capture(tmp_path / "x.pcapng").read_bytes()
    for frame, event, moment_us in ((READ_RTU, 3, 3000), (EXCEPTION_RTU, 4, 4000)):
        head = data[: data.index(frame)][-12:]
        assert head == (2).to_bytes(4, "big") + moment_us.to_bytes(4, "big") + bytes((event, 0, 0, 0))


def test_a_trace_without_frames_is_an_empty_capture(tmp_path: Path) -> None:
    (written,) = write_trace(Trace(["bus"]), tmp_path / "x.pcapng")
    data = written.read_bytes()
    lengths, at = [], 0
    while at < len(data):
        lengths.append(int.from_bytes(data[at + 4 : at + 8], "little"))
        assert data[at + lengths[-1] - 4 : at + lengths[-1]] == data[at + 4 : at + 8]
        at += lengths[-1]
    assert len(lengths) == 3


def test_modbus_tcp_is_told_by_its_header() -> None:
    assert is_modbus_tcp(READ_TCP)
    assert not is_modbus_tcp(READ_RTU)
    assert not is_modbus_tcp(b"P1000\r")
