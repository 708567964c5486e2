"""What was saved is there: after kill -9, after power loss, with one owner."""

from __future__ import annotations

import errno
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

import pytest

import steptwin
from steptwin.errors import Misuse
from steptwin.files.memory import StateDirectory, StateFailure, StateInUse

SIZE = 2000
"""User registers 1000–1999."""


def image(number: int) -> bytes:
    """Content that differs in every part from one save to the next."""
    return number.to_bytes(4, "big") * (SIZE // 4)


# ---------------------------------------------------------------------- saving and loading


def test_what_was_never_saved_is_none(tmp_path: Path) -> None:
    with StateDirectory(tmp_path) as state:
        assert state.load("unit1") is None


def test_the_last_save_counts(tmp_path: Path) -> None:
    with StateDirectory(tmp_path / "new" / "state") as state:
        for number in range(5):
            state.save("unit1", image(number))
            assert state.load("unit1") == image(number)
        state.save("unit2", b"")
    with StateDirectory(tmp_path / "new" / "state") as state:
        assert state.load("unit1") == image(4)
        assert state.load("unit2") == b""


@pytest.mark.parametrize("name", ["", "../x", "a/b", ".x", "a.b", "x" * 65, "ä"])
def test_a_name_is_a_name(tmp_path: Path, name: str) -> None:
    with StateDirectory(tmp_path) as state, pytest.raises(Misuse, match="permitted are up to 64 letters"):
        state.save(name, b"")


def test_a_directory_that_is_not_open_keeps_nothing(tmp_path: Path) -> None:
    with pytest.raises(Misuse, match="is not open"):
        StateDirectory(tmp_path).save("unit1", b"")


def test_a_file_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("")
    with pytest.raises(StateFailure, match="cannot be used: not a directory"), StateDirectory(tmp_path / "state"):
        pass


# ---------------------------------------------------------------------- one owner


def test_the_second_owner_is_told_who_the_first_is(tmp_path: Path) -> None:
    with StateDirectory(tmp_path), pytest.raises(StateInUse, match=f"in use by process {os.getpid()}"), StateDirectory(tmp_path):
        pass
    with StateDirectory(tmp_path) as again:
        assert again.load("unit1") is None


def test_another_process_owns_it_until_it_is_killed(tmp_path: Path) -> None:
    with _saver(tmp_path) as (child, says):
        says.readline()
        with pytest.raises(StateInUse, match=f"in use by process {child.pid}$"), StateDirectory(tmp_path):
            pass
        child.kill()
        child.wait()
        with StateDirectory(tmp_path) as state:
            assert state.load("unit1") is not None


def test_nothing_but_images_stays_when_the_owner_ends(tmp_path: Path) -> None:
    with StateDirectory(tmp_path) as state:
        assert (tmp_path / "owner.lock").exists()
        state.save("unit1", image(1))
        state.save("unit1", image(2))
    assert {path.name for path in tmp_path.iterdir()} == {"unit1.image"}


# ---------------------------------------------------------------------- damage


def _saved(path: Path) -> Path:
    """The file of an image."""
    with StateDirectory(path) as state:
        state.save("unit1", image(1))
        state.save("unit1", image(2))
    return path / "unit1.image"


def test_an_image_of_another_length_is_damaged(tmp_path: Path) -> None:
    file = _saved(tmp_path)
    whole = file.read_bytes()
    with StateDirectory(tmp_path) as state:
        for length in [*range(40), *range(40, len(whole), 97), len(whole) - 1]:
            file.write_bytes(whole[:length])
            with pytest.raises(StateFailure, match=r"unit1\.image is damaged; remove it to start anew"):
                state.load("unit1")
        file.write_bytes(whole + b"\0")
        with pytest.raises(StateFailure, match="is damaged"):
            state.load("unit1")
        file.write_bytes(whole)
        assert state.load("unit1") == image(2)


def test_any_flipped_bit_is_found(tmp_path: Path) -> None:
    file = _saved(tmp_path)
    whole = file.read_bytes()
    with StateDirectory(tmp_path) as state:
        for place in [*range(24), *range(24, len(whole), 61)]:
            file.write_bytes(whole[:place] + bytes([whole[place] ^ 0x10]) + whole[place + 1 :])
            with pytest.raises(StateFailure, match=r"is damaged|has format"):
                state.load("unit1")


def test_a_damaged_image_can_be_saved_anew(tmp_path: Path) -> None:
    _saved(tmp_path).write_bytes(b"torn")
    with StateDirectory(tmp_path) as state:
        state.save("unit1", image(3))
        assert state.load("unit1") == image(3)


def test_an_image_of_a_newer_format_is_refused_and_left_alone(tmp_path: Path) -> None:
    file = _saved(tmp_path)
    newer = b"STW3" + file.read_bytes()[4:]
    file.write_bytes(newer)
    with StateDirectory(tmp_path) as state:
        for act in (lambda: state.load("unit1"), lambda: state.save("unit1", image(3))):
            with pytest.raises(StateFailure, match="has format STW3, this version of steptwin reads and writes STW2"):
                act()
    assert file.read_bytes() == newer


@pytest.mark.parametrize("slot", [0, 1])
def test_an_image_of_the_earlier_format_is_not_passed_over(tmp_path: Path, slot: int) -> None:
    (tmp_path / f"unit1.{slot}").write_bytes(b"STW1" + bytes(100))
    with StateDirectory(tmp_path) as state, pytest.raises(StateFailure, match=rf"earlier format \(unit1\.{slot}\)"):
        state.load("unit1")


def test_what_is_no_file_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "unit1.image").mkdir()
    with StateDirectory(tmp_path) as state, pytest.raises(StateFailure, match=r"unit1\.image"):
        state.load("unit1")


# ---------------------------------------------------------------------- power loss: the calls that reach the disk fail one by one


class PowerLoss(BaseException):
    """Nothing happens after this."""


@pytest.mark.parametrize("saves", [1, 2, 3])
@pytest.mark.parametrize("stop", range(6))
def test_power_lost_between_any_two_steps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, saves: int, stop: int) -> None:
    """Every step of a save that reaches the disk, stopped before it; what was not synced is lost."""
    with StateDirectory(tmp_path) as state:
        for number in range(1, saves):
            state.save("unit1", image(number))
        steps = 0

        def breaking(real: Callable[..., object]) -> Callable[..., object]:
            def step(*arguments: object, **named: object) -> object:
                nonlocal steps
                if steps == stop:
                    raise PowerLoss
                steps += 1
                return real(*arguments, **named)

            return step

        monkeypatch.setattr(os, "fsync", breaking(os.fsync))
        monkeypatch.setattr(Path, "replace", breaking(Path.replace))
        with suppress(PowerLoss):
            state.save("unit1", image(saves))
        monkeypatch.undo()
        if stop == 0:
            (tmp_path / ".1.unfinished").write_bytes(image(saves)[:100])  # before fsync any part may be missing
    with StateDirectory(tmp_path) as state:
        old = image(saves - 1) if saves > 1 else None
        wanted = {0: [old], 1: [old], 2: [image(saves)]}.get(stop, [image(saves)])
        assert state.load("unit1") in wanted
        assert steps == min(stop, 3)
        assert [path.name for path in tmp_path.glob(".*")] == []
        state.save("unit1", image(77))
        assert state.load("unit1") == image(77)


def test_the_file_reaches_the_disk_before_its_name_and_the_name_before_save_returns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    real_sync, real_replace = os.fsync, Path.replace

    def sync(handle: int) -> None:
        order.append("fsync " + Path(os.readlink(f"/proc/self/fd/{handle}")).name.rpartition(".")[2])
        real_sync(handle)

    def replace(path: Path, target: Path) -> Path:
        order.append(f"rename {path.name.rpartition('.')[2]} {target.name}")
        return real_replace(path, target)

    with StateDirectory(tmp_path / "state") as state:
        monkeypatch.setattr(os, "fsync", sync)
        monkeypatch.setattr(Path, "replace", replace)
        state.save("unit1", b"1")
        state.save("unit1", b"2")
        state.save("unit1", b"3")
    assert order == 3 * ["fsync unfinished", "rename unfinished unit1.image", "fsync state"]


def test_a_full_disk_is_said_and_keeps_the_old_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(handle: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with StateDirectory(tmp_path) as state:
        state.save("unit1", image(1))
        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(StateFailure, match=r"unit1 cannot be saved in .*: no space left on device"):
            state.save("unit1", image(2))
        assert state.load("unit1") == image(1)


# ---------------------------------------------------------------------- kill -9

SAVER = """
import sys
from steptwin.files.memory import StateDirectory
with StateDirectory(sys.argv[1]) as state:
    last = state.load("unit1")
    number = int.from_bytes(last[:4], "big") if last else 0
    while True:
        number += 1
        state.save("unit1", number.to_bytes(4, "big") * 500)
        print(number, flush=True)
"""


@contextmanager
def _saver(path: Path) -> Generator[tuple[subprocess.Popen[str], IO[str]], None, None]:
    """A process that saves 1, 2, 3, … and says so after each; with what it says."""
    source = Path(steptwin.__file__).parents[1]
    child = subprocess.Popen(
        [sys.executable, "-S", "-c", SAVER, str(path)],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(source)},
    )
    with child:
        try:
            assert child.stdout is not None
            yield child, child.stdout
        finally:
            child.kill()


def test_a_saving_process_killed_again_and_again_loses_nothing(tmp_path: Path) -> None:
    """The content found is one that was saved, whole, and not older than the last save that returned."""
    chance = random.Random(488)
    found = 0
    for _ in range(15):
        with _saver(tmp_path) as (child, says):
            first = int(says.readline())
            assert first == found + 1
            time.sleep(chance.uniform(0.0, 0.02))
            child.send_signal(signal.SIGKILL)
            told = [first, *map(int, says.read().split("\n")[:-1])]
        with StateDirectory(tmp_path) as state:
            content = state.load("unit1")
        assert content is not None
        found = int.from_bytes(content[:4], "big")
        assert content == image(found)
        assert told[-1] <= found <= told[-1] + 1
    assert found > 15
