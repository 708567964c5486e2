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
            "import dataclasses, steptwin.mic488.registers as t; t.ROWS += (dataclasses.replace(t.ROWS[-1], name='NEW'),)",
            "steptwin.mic488.device",
            "register NEW lacks its behaviour",
        ),
        (
            "import steptwin.wbc.statements as t; t.STATEMENTS['NEW'] = t.StatementRow('NEW', (), '')",
            "steptwin.wbc.resolve",
            "statement NEW lacks its step",
        ),
        (
            "import steptwin.wbc.statements as t; del t.STATEMENTS['WAIT']",
            "steptwin.wbc.resolve",
            "step of WAIT: there is no such statement",
        ),
        (
            "import steptwin.wbc.steps as t; t.STEPS += (t.ProgramStep,)",
            "steptwin.wbc.compile",
            "step ProgramStep lacks its code",
        ),
        (
            "import steptwin.wbc.registers as t; t.ROWS['NEW'] = t.ROWS['OUT']",
            "steptwin.mic488.program_registers",
            "register NEW lacks its access",
        ),
        *(
            (
                f"import steptwin.simulation.script.steps as t\nclass New: ...\n{change}",
                "steptwin.simulation.world.simulation",
                message,
            )
            for change, message in (
                ("t.Step |= New", "step New lacks its action"),
                (
                    "import typing; t.Step = typing.Union[*(set(typing.get_args(t.Step)) - {t.Note})]",
                    "action of Note: there is no such step",
                ),
            )
        ),
        (
            "import steptwin.simulation.world.inputs as t; t.FOR_SCRIPTS |= {t.Bytes}",
            "steptwin.simulation.world.scripts",
            "step of scripts Bytes lacks its execution",
        ),
        (
            "import steptwin.simulation.world.inputs as t; t.ExternalInput |= int",
            "steptwin.simulation.world.actions",
            "step int lacks its action",
        ),
        *(
            (f"import steptwin.wbc.statements as t; {change}", "steptwin.mic488.program_motion", message)
            for change, message in (
                ("t.MOTIONS |= {'NEW'}", "motion statement NEW lacks its move"),
                ("t.HALTS -= {'STOP'}", "action of STOP: there is no such statement that halts"),
                ("t.ROW_MOTIONS |= {'NEW'}", "statement with a row NEW lacks its check"),
                ("t.OPERATORS['**'] = 'power'", "operator ** lacks its operation"),
                ("t.COMPARISONS['<>'] = 'other'", "comparison <> lacks its test"),
                ("t.FUNCTIONS['EXP'] = t.FUNCTIONS['SIN']", "function EXP lacks its calculation"),
                ("del t.FUNCTIONS['SIN']", "calculation of SIN: there is no such function"),
            )
        ),
    ],
)
def test_a_row_alone_is_refused_at_import(adding_a_row: str, module: str, message: str) -> None:
    code = f"{adding_a_row}\nimport {module}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert done.stderr.splitlines()[-1] == f"steptwin.tables.IncompleteTable: {message}"
