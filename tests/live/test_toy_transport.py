"""A transport that only the tests know opens lines of every kind: descriptions, `up`, recordings and faults know its places."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from toy import kind as toy_kind
from toy import transport

from steptwin.errors import Misuse
from steptwin.files.recording import load
from steptwin.files.world import World
from steptwin.files.worldoptions import WorldRunOptions
from steptwin.live.options import UpOptions
from steptwin.live.running import up
from steptwin.live.transports import forget, register
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.simulation.toml.reader import WorldError
from steptwin.simulation.world.inputs import Bytes
from steptwin.wire.crc import with_crc

TEXT = """
[world]
name = "over unix"
[[line]]
name = "bus"
unix = "{folder}/bus"
[[line]]
name = "toys"
kind = "toys"
unix = "{folder}/toys"
[[mic488]]
name = "table"
line = "bus"
[[toy]]
name = "t"
line = "toys"
[[fault]]
kind = "crc"
line = "bus"
link = "unix"
nth = 2
[[script]]
name = "operator"
steps = [{{ until = "table.OUT1 > 0", within = "30 s" }}, {{ stop = "done" }}]
"""
OUTPUT_ON = with_crc(bytes.fromhex("01 05 17 70 FF 00"))  # FC5, OUT1 at 6000


@pytest.fixture(autouse=True)
def known() -> Iterator[None]:
    with toy_kind.registered(), transport.registered():
        yield


def asked(path: Path, request: bytes, count: int, times: int = 1) -> bytes:
    with socket.socket(socket.AF_UNIX) as client:
        client.settimeout(20)
        while True:
            try:
                client.connect(str(path))
                break
            except OSError:
                time.sleep(0.01)  # the world is still being opened
        answer = b""
        for _ in range(times):
            client.sendall(request)
            answer = b""
            while len(answer) < count:
                answer += client.recv(count - len(answer))
        return answer


def test_up_serves_lines_of_every_kind_over_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    place, recording = tmp_path / "world.toml", tmp_path / "session.json"
    place.write_text(TEXT.format(folder=tmp_path), "utf-8")
    read = with_crc(bytes.fromhex("01 01 17 70 00 01"))

    def clients() -> tuple[bytes, bytes, bytes]:
        toy = asked(tmp_path / "toys", b"P\0", 2)
        return toy, asked(tmp_path / "bus", read, 6, times=2), asked(tmp_path / "bus", OUTPUT_ON, 8)

    with ThreadPoolExecutor() as pool:
        answers = pool.submit(clients)
        assert up(UpOptions(world=place, run=WorldRunOptions(session=recording)))
    toy, damaged, done = answers.result()
    right = with_crc(bytes.fromhex("01 01 01 00"))
    assert (toy, done) == (b"P\0", OUTPUT_ON)
    assert damaged[:4] == right[:4]
    assert damaged != right, "the fault of the link has struck the second answer"
    assert list(tmp_path.glob("bus")) + list(tmp_path.glob("toys")) == []
    again = load(recording)
    places = {given.what.place for given in again.inputs if isinstance(given.what, Bytes)}
    assert places == {"unix-1", "unix-2"}
    assert again.replay().trace.digest() == again.digest


def test_it_is_a_key_like_the_others() -> None:
    assert [name for name, kind in line_kinds().items() if "unix" in kind.opened_by] == ["modbus", "m1486", "toys"]
    with pytest.raises(Misuse, match=r"there is a key 'unix' of \[\[line\]\] already"):
        register(transport.UNIX_KEY, transport.UNIX)


def test_descriptions_know_it_while_it_is_registered() -> None:
    text = '[[line]]\nname = "bus"\nunix = "somewhere"\n[[mic488]]\nname = "table"\nline = "bus"\n'
    assert World.from_toml(text).spec.lines[0].links == {"unix": "somewhere"}
    forget("unix")
    try:
        with pytest.raises(WorldError, match=r"\[line\] has no 'unix'"):
            World.from_toml(text)
    finally:
        register(transport.UNIX_KEY, transport.UNIX)
