"""Every kind of fault with all it takes, reviewed once: golden/kinds.txt.

Regenerate with ``python tests/simulation/faults/test_table.py`` and read the diff.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from steptwin.errors import Misuse
from steptwin.simulation.components.registry import failing, fault_kinds
from steptwin.simulation.faults import kinds
from steptwin.simulation.faults.kinds import rows, shared
from steptwin.simulation.faults.table import LARGEST_WHOLE, FaultKind, Layer, Parameter, ParameterForm, check

KINDS = fault_kinds()
GOLDEN = Path(__file__).parent / "golden" / "kinds.txt"


def described(parameter: Parameter) -> str:
    without = "required" if parameter.is_required else f"else {parameter.otherwise}" if parameter.otherwise else "default"
    return f"    {parameter.name}: {parameter.permitted} | {without} {parameter.default!r} | {parameter.meaning}"


def kind_lines(kind: FaultKind) -> list[str]:
    """``on``: the lines or the elements that can have it, otherwise machines."""
    having = ", ".join(failing(kind) or (line.value for line in kind.lines))
    head = f"{kind.name}: {kind.layer.value}, {kind.occasion.value}, on {having or 'controllers'} | {kind.meaning}"
    return [head, *map(described, kind.parameters)]


def test_kinds_are_the_reviewed_ones() -> None:
    found = [line for kind in KINDS.values() for line in kind_lines(kind)]
    assert found == GOLDEN.read_text(encoding="utf-8").splitlines()


def test_kinds_of_an_element_come_and_go_with_it() -> None:
    kind = next(kind for kind in kinds.KINDS.values() if kind.layer is Layer.PHYSICS)
    before = list(kinds.KINDS)
    other = replace(kind, name="other")
    kinds.add_kinds([other])
    assert kinds.KINDS["other"] is other
    kinds.remove_kinds([other])
    assert list(kinds.KINDS) == before


@pytest.mark.parametrize(
    ("least", "most", "permitted"),
    [
        (0.5, 1e6, "numbers 0.5 to 1 000 000"),
        (-1e6, 999_999.5, "numbers -1 000 000 to 999999.5"),
        (1e6, None, "numbers 1 000 000 and more"),
        (0.000001, None, "numbers 0.000001 and more"),
        (None, None, "numbers"),
    ],
)
def test_ranges_are_written_without_exponents(least: float | None, most: float | None, permitted: str) -> None:
    assert Parameter("x", ParameterForm.NUMBER, "X.", least, most).permitted == permitted


def test_kinds_by_layer() -> None:
    assert list(rows()) == list(KINDS.values())
    assert list(rows(Layer.PHYSICS)) == [kind for kind in KINDS.values() if kind.layer is Layer.PHYSICS]
    assert {kind.layer for kind in rows(Layer.FRAMES, Layer.PROTOCOL)} == {Layer.FRAMES, Layer.PROTOCOL}


def test_shared_parameters_say_which_kinds_have_them() -> None:
    """Each is in all kinds of what it is said to be shared by, and the texts are without repetition."""
    found = shared()
    assert [(parameter.name, of) for parameter, of in found][:7] == [
        ("direction", "bytes"),
        ("link", "bytes, frames, protocol"),
        ("line", "bytes, frames, protocol"),
        ("unit", "frames, protocol"),
        ("function", "frames, protocol"),
        ("address", "frames, protocol"),
        ("machine", "physics"),
    ]
    assert {parameter.name: of for parameter, of in found}["from_s"] == (
        "each byte, each delivery, each answer, each request, each change, each save, stuck, master-error, "
        + ", ".join(kind.name for kind in rows(Layer.ELEMENT))
    )
    assert len({parameter for parameter, _ in found}) == len(found)
    for parameter, of in found:
        for layer in Layer:
            if layer.value in of.split(", "):
                assert all(parameter in kind.parameters for kind in rows(layer)), (parameter.name, layer)
    own = [parameter for kind in KINDS.values() for parameter in kind.own]
    assert not {parameter for parameter, _ in found} & set(own)


@pytest.mark.parametrize(
    ("form", "least", "most", "value", "found"),
    [
        (ParameterForm.WHOLE, 1, 5, 1, 1),
        (ParameterForm.WHOLE, 1, 5, 5, 5),
        (ParameterForm.WHOLE, 1, 5, 0, None),
        (ParameterForm.WHOLE, 1, 5, 6, None),
        (ParameterForm.WHOLE, 1, 5, 1.0, None),
        (ParameterForm.WHOLE, 1, 5, True, None),
        (ParameterForm.WHOLE, 1, None, LARGEST_WHOLE - 1, LARGEST_WHOLE - 1),
        (ParameterForm.WHOLE, None, None, 1 - LARGEST_WHOLE, 1 - LARGEST_WHOLE),
        (ParameterForm.WHOLE, 1, None, LARGEST_WHOLE, None),
        (ParameterForm.WHOLE, None, None, -LARGEST_WHOLE, None),
        (ParameterForm.NUMBER, 0.5, 2, 0.5, 0.5),
        (ParameterForm.NUMBER, 0.5, 2, 2, 2.0),
        (ParameterForm.NUMBER, 0.5, 2, 0.49, None),
        (ParameterForm.NUMBER, 0.5, 2, 2.01, None),
        (ParameterForm.NUMBER, 0, 2, False, None),
        (ParameterForm.NUMBER, 0, 2, float("nan"), None),
        (ParameterForm.NUMBER, 0, 2, float("inf"), None),
        (ParameterForm.NUMBER, 0, 2, "1", None),
        (ParameterForm.SPAN, 0, 9, 3, (3, 3)),
        (ParameterForm.SPAN, 0, 9, "3-9", (3, 9)),
        (ParameterForm.SPAN, 0, 9, "3", (3, 3)),
        (ParameterForm.SPAN, 0, 9, "0-0", (0, 0)),
        (ParameterForm.SPAN, 0, 9, "4-3", None),
        (ParameterForm.SPAN, 0, 9, "3-10", None),
        (ParameterForm.SPAN, 0, 9, "x", None),
    ],
)
def test_what_a_parameter_takes(
    form: ParameterForm, least: float | None, most: float | None, value: object, found: object
) -> None:
    parameter = Parameter("p", form, "Something.", least, most)
    if found is not None:
        taken = check(parameter, value, "here")
        assert (taken, type(taken)) == (found, type(found))
        return
    with pytest.raises(Misuse, match=r"^here.*permitted are"):
        check(parameter, value, "here")


if __name__ == "__main__":
    GOLDEN.write_text("\n".join(line for kind in KINDS.values() for line in kind_lines(kind)) + "\n", "utf-8")
