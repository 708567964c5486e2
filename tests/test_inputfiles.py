"""What bounds the files that a user names."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from steptwin.errors import Misuse
from steptwin.inputfiles import MOST_BYTES, MOST_RECORDED_VALUES, read_bytes, read_recorded


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "file"


def test_a_file_has_at_most_so_many_bytes(file: Path) -> None:
    file.write_bytes(b"x" * MOST_BYTES)
    assert len(read_bytes(file)) == MOST_BYTES
    file.write_bytes(b"x" * (MOST_BYTES + 1))
    with pytest.raises(Misuse, match=f"it has {MOST_BYTES + 1} bytes; permitted are at most {MOST_BYTES}"):
        read_bytes(file)


@pytest.mark.parametrize("value", ["[]", "{}", "0"])
def test_a_recorded_file_has_at_most_so_many_values(file: Path, value: str) -> None:
    """Small on disk, but not in memory when it is parsed."""
    file.write_text(f"[{','.join([value] * MOST_RECORDED_VALUES)},0]")
    with pytest.raises(Misuse, match=f"values; permitted are at most {MOST_RECORDED_VALUES}"):
        read_recorded(file)


def test_a_recorded_file_within_the_bounds(file: Path) -> None:
    text = json.dumps({"name": "Wózek", "inputs": [{"time_ns": 1, "data": [1, 2]}]}, ensure_ascii=False)
    file.write_text(text, "utf-8")
    assert read_recorded(file) == text


def test_a_recorded_file_is_utf8(file: Path) -> None:
    file.write_bytes(b'{"name": "\xff"}')
    with pytest.raises(Misuse, match="it is not UTF-8 text"):
        read_recorded(file)


def test_a_recorded_file_has_at_most_so_many_bytes(file: Path) -> None:
    file.write_bytes(b"[1, 2, 3, 4]")
    with pytest.raises(Misuse, match="it has 12 bytes; permitted are at most 10"):
        read_recorded(file, most=10)
