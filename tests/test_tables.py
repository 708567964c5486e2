"""Tables are closed at import, in both directions."""

from __future__ import annotations

import subprocess
import sys

import pytest

from steptwin.tables import IncompleteTable, complete


class Row: ...


@pytest.mark.parametrize(
    ("keys", "given", "message"),
    [
        (["A", "B", "C"], {"A": 1}, "row B, C lacks its behaviour"),
        (["A"], {"A": 1, "B": 2, "C": 3}, "behaviour of B, C: there is no such row"),
        ([Row], {}, "row Row lacks its behaviour"),
    ],
)
def test_what_is_missing_is_named(keys: list[object], given: dict[object, int], message: str) -> None:
    with pytest.raises(IncompleteTable) as caught:
        complete("row", keys, "behaviour", given)
    assert str(caught.value) == message


def test_a_complete_table_is_read_only() -> None:
    table = complete("row", ["A"], "behaviour", {"A": 1})
    assert table == {"A": 1}
    with pytest.raises(TypeError):
        table["A"] = 2  # type: ignore[index]


@pytest.mark.parametrize(
    ("adding_a_row", "module", "message"),
    [
        (
            "import dataclasses, steptwin.mic488.registers as t; t.ROWS += (dataclasses.replace(t.ROWS[-1], key='NEW'),)",
            "steptwin.mic488.device",
            "register NEW lacks its behaviour",
        ),
    ],
)
def test_a_row_alone_is_refused_at_import(adding_a_row: str, module: str, message: str) -> None:
    code = f"{adding_a_row}\nimport {module}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert done.stderr.splitlines()[-1] == f"steptwin.tables.IncompleteTable: {message}"
