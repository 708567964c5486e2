"""Files of a description lie beside it: a description from elsewhere must not carry away other files of its user."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from steptwin.errors import Misuse
from steptwin.files.world import World

MACHINE = '[[mic488]]\nname = "table"\nconfig = {name!r}\n'


def load(folder: Path, name: str, *, allow_outside: bool = False) -> World:
    path = folder / "w.toml"
    path.write_text(MACHINE.format(name=name))
    return World.load(path, allow_outside=allow_outside)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "in" / "below").mkdir(parents=True)
    for path in (tmp_path / "secret.cfg", tmp_path / "in" / "own.cfg", tmp_path / "in" / "below" / "own.cfg"):
        path.write_text("[Axis0]\nGear=2\n")
    (tmp_path / "in" / "link.cfg").symlink_to(tmp_path / "secret.cfg")
    (tmp_path / "in" / "circle.cfg").symlink_to("circle.cfg")
    os.mkfifo(tmp_path / "in" / "pipe.cfg")
    return tmp_path / "in"


@pytest.mark.parametrize("name", ["own.cfg", "below/own.cfg", "below/../own.cfg", "./own.cfg"])
def test_files_beside_the_description_and_below(folder: Path, name: str) -> None:
    assert name in load(folder, name).files


@pytest.mark.parametrize("name", ["../secret.cfg", "{folder}/../secret.cfg", "link.cfg", "below/../../secret.cfg"])
def test_files_elsewhere_are_for_those_who_allow_it(folder: Path, name: str) -> None:
    name = name.format(folder=folder)
    with pytest.raises(Misuse, match=r"w\.toml:3:1: error D009: .* is outside the folder of the description"):
        load(folder, name)
    assert name in load(folder, name, allow_outside=True).files


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("/dev/zero", "is outside the folder"),
        ("none.cfg", r"cannot read .*none\.cfg: no such file"),
        ("pipe.cfg", "it is a pipe, not a file"),
        ("below", "it is a directory, not a file"),
        ("circle.cfg", "circle.cfg"),
        ("x" * 5000, "file name too long"),
    ],
)
def test_what_cannot_be_read_is_told_where_it_is_named(folder: Path, name: str, message: str) -> None:
    with pytest.raises(Misuse, match=rf"w\.toml:3:1: error D009: .*{message}"):
        load(folder, name)
    if name == "/dev/zero":
        with pytest.raises(Misuse, match="it is a device, not a file"):
            load(folder, name, allow_outside=True)
