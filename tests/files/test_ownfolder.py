"""Where requests may write."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from steptwin.errors import Misuse
from steptwin.files.ownfolder import path_in_folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with links out of it, and back into it."""
    own = tmp_path / "own"
    (own / "sub").mkdir(parents=True)
    (own / "there.json").write_text("{}")
    (tmp_path / "precious.json").write_text("{}")
    (own / "link.json").symlink_to(tmp_path / "precious.json")
    (own / "nowhere.json").symlink_to(tmp_path / "missing.json")
    (own / "inner.json").symlink_to(own / "there.json")
    (own / "circle.json").symlink_to(own / "circle.json")
    (own / "out").symlink_to(tmp_path)
    os.link(tmp_path / "precious.json", own / "second.json")
    return own


@pytest.mark.parametrize("name", ["new.json", "there.json", "sub/new.json", "./new.json", "sub/../new.json"])
def test_files_in_the_folder_and_below_it(name: str, folder: Path) -> None:
    assert path_in_folder(folder, name) == folder / name
    assert path_in_folder(folder, str(folder / name)) == folder / name


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("../precious.json", "requests write into {folder} only"),
        ("../own2/new.json", "requests write into {folder} only"),
        ("out/precious.json", "requests write into {folder} only"),
        ("out/missing/new.json", "requests write into {folder} only"),
        ("sub/../../precious.json", "requests write into {folder} only"),
        ("..", "requests write into {folder} only"),
        ("/etc/passwd", "requests write into {folder} only"),
        ("link.json", "it is a link"),
        ("nowhere.json", "it is a link"),
        ("inner.json", "it is a link"),
        ("circle.json", "it is a link"),
        ("second.json", "it is a link"),
        ("circle.json/new.json", "cannot write"),
        ("x" * 5000, "cannot write"),
    ],
)
def test_places_elsewhere_and_links_are_refused(name: str, message: str, folder: Path) -> None:
    with pytest.raises(Misuse) as refused:
        path_in_folder(folder, name)
    assert message.format(folder=folder) in str(refused.value)


def test_a_folder_that_is_reached_through_a_link_is_the_same(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "way").symlink_to(folder)
    assert path_in_folder(tmp_path / "way", str(folder / "new.json")) == folder / "new.json"
