"""Non-volatile memory of a world that lasts."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from steptwin.files import recording as recordings
from steptwin.files.memory import StateDirectory, StateInUse
from steptwin.files.world import World
from steptwin.simulation.script.steps import Send, Write

CONTROLLER = """
[[line]]
name = "bus"
[[mic488]]
name = "table"
line = "bus"
"""
CHIP = """
[[line]]
name = "bus"
kind = "m1486"
[[m1486]]
name = "loader"
line = "bus"
variant = "E1"
"""


def _stored(world: World) -> int:
    device = world.mic488["table"].device
    device.load_memory()
    return device.user[1000]


def _save(world: World, value: int) -> None:
    device = world.mic488["table"].device
    device.user[1000] = value
    device.save_memory()


def _begin(directory: Path, text: str, more: str = "", **options: object) -> World:
    (directory / "machine.toml").write_text(f"{more}\n{text}")
    return World.load(directory / "machine.toml", **options)  # type: ignore[arg-type]


def test_user_registers_last_from_world_to_world(tmp_path: Path) -> None:
    with _begin(tmp_path, CONTROLLER, '[world]\nstate = "memory"') as world:
        assert _stored(world) == 0
        _save(world, 4711)
    with _begin(tmp_path, CONTROLLER, '[world]\nstate = "memory"') as world:
        assert _stored(world) == 4711
    with _begin(tmp_path, CONTROLLER) as world:
        assert _stored(world) == 0


def test_a_directory_that_is_given_replaces_that_of_the_description(tmp_path: Path) -> None:
    with _begin(tmp_path, CONTROLLER, '[world]\nstate = "memory"', state=tmp_path / "other") as world:
        _save(world, 7)
    assert not (tmp_path / "memory").exists()
    with World.from_toml(CONTROLLER, state=tmp_path / "other") as world:
        assert _stored(world) == 7


def test_the_directory_belongs_to_one_world_until_it_is_closed(tmp_path: Path) -> None:
    with _begin(tmp_path, CONTROLLER, '[world]\nstate = "memory"'):
        with pytest.raises(StateInUse):
            _begin(tmp_path, CONTROLLER, '[world]\nstate = "memory"')
        assert (tmp_path / "memory" / "owner.lock").exists()
    assert not (tmp_path / "memory" / "owner.lock").exists()


def test_an_eeprom_lasts_and_is_run_at_power_on(tmp_path: Path) -> None:
    """What the host stores is there when the chip is switched on again: position 100 without a word on the line."""
    with _begin(tmp_path, CHIP, '[world]\nstate = "memory"') as world:
        world.apply_input(Send("bus", b"[\rF\rA40\rW\r]\r"))
        world.run(for_="3 s")
        image = world.m1486["loader"].chip.image
        assert image
    with StateDirectory(tmp_path / "memory") as state:
        assert state.load("loader") == image
    with _begin(tmp_path, CHIP, '[world]\nstate = "memory"') as world:
        assert world.m1486["loader"].chip.image == image


def test_a_session_replays_from_the_memory_it_began_with(tmp_path: Path) -> None:
    with _begin(tmp_path, CONTROLLER, '[world]\nstate = "memory"') as world:
        _save(world, 4711)
    with _begin(tmp_path, CONTROLLER, '[world]\nstate = "memory"') as world:
        world.run(for_="1 s")
        recording = recordings.recording_of(world)
        _save(world, 1)
    recordings.save(recording, tmp_path / "run.json")
    replayed = recordings.load(tmp_path / "run.json").replay()
    assert _stored(replayed) == 4711
    assert replayed.trace.digest() == recording.digest
    with StateDirectory(tmp_path / "memory") as state:  # a replay keeps nothing
        assert state.load("table") != (4711).to_bytes(2, "big") + bytes(1998)


def test_memory_that_does_not_fit_is_refused_at_its_controller(tmp_path: Path) -> None:
    with StateDirectory(tmp_path / "memory") as state:
        state.save("table", b"abc")
    with pytest.raises(Exception, match="2000 bytes, not 3") as raised:
        _begin(tmp_path, CONTROLLER, '[world]\nstate = "memory"')
    assert "machine.toml" in str(raised.value)
    assert not (tmp_path / "memory" / "owner.lock").exists()


def test_a_directory_elsewhere_needs_a_permission(tmp_path: Path) -> None:
    (tmp_path / "machine").mkdir()
    with pytest.raises(Exception, match="allow-outside"):
        _begin(tmp_path / "machine", CONTROLLER, '[world]\nstate = "../memory"')
    assert not (tmp_path / "memory").exists()


SAVING = {
    "mic488": (CONTROLLER, Write((("table", "USER_REG_SAVE", 1.0),)), ("memory-failure", "table")),
    "m1486": (CHIP, Send("bus", b"[\rF\rA40\rW\r]\r"), ("store-failed", "loader")),
}


@pytest.mark.parametrize("kind", SAVING)
def test_a_save_that_failed_fails_in_the_replay_too(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(handle: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    text, save, (code, controller) = SAVING[kind]
    with _begin(tmp_path, text, '[world]\nstate = "memory"') as world:
        world.run(for_="1 s")
        with monkeypatch.context() as disk:
            disk.setattr(os, "fsync", full)
            world.apply_input(save)
            world.run(for_="3 s")
        world.apply_input(save)
        world.run(for_="3 s")
        recording = recordings.recording_of(world)
        recordings.save(recording, tmp_path / "s.json")
        (failed,) = [record for record in world.trace.events(controller) if record.subject == code]
        assert "no space left on device" in str(failed.value)
        assert [(one.time, one.controller) for one in world.failed_saves] == [(failed.time, controller)]
    again = recordings.load(tmp_path / "s.json").replay()
    assert again.trace.digest() == recording.digest
    assert recordings.recording_of(again) == recording
