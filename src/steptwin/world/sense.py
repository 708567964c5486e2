"""Keys of a description that mean nothing where they stand, beside or without others."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.world.kinds import KINDS, line_kinds
from steptwin.world.reader import Path, TomlText

_NEED: Mapping[str, Mapping[str, str]] = {
    "switch": {"width": "position", "period": "position", "bounces": "bounce"},
    "button": {"bounces": "bounce"},
    "encoder": {"offset": "index", "index_width": "index"},
    "event": {"once": "when"},
}
"""Keys that mean nothing without another."""
_EXCLUDE: Mapping[str, tuple[tuple[str, str], ...]] = {
    "axis": (("pulses_per_unit", "pitch"),),
    "encoder": (("counts_per_rev", "counts_per_unit"),),
}
"""Keys that exclude each other: two ways of giving the same value."""
_ONLY: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "source": {
        "value": ("constant", "sine"),
        "amplitude": ("sine",),
        "frequency": ("sine",),
        "phase": ("sine",),
        "points": ("table",),
        "begin": ("ramp",),
        "end": ("ramp",),
        "over": ("ramp",),
        "repeat": ("ramp", "table"),
        "period": ("ramp", "sine", "table"),
    },
    "motor": {"mass": ("linear",), "friction_force": ("linear",), "force": ("linear",)},
}
"""Keys that some kinds only have."""
_USUAL = {"line": "modbus", "source": "constant"}


def check_sense(text: TomlText, path: Path, name: str, table: object, kind: object = None) -> None:
    """Report keys without effect in a table called ``name``. ``kind`` is what its keys depend on, unless given there."""
    if not isinstance(table, Mapping):
        return  # told already
    for key, other in _NEED.get(name, {}).items():
        if key in table and other not in table:
            text.wrong((*path, key), "D007", f"{key} means nothing without {other}")
    controller = KINDS.get(name)
    for one, other in _EXCLUDE.get(name, () if controller is None else controller.exclusive):
        if one in table and other in table:
            text.wrong((*path, other), "D007", f"{one} and {other} exclude each other")
    owner = path if kind is None else path[:-1]
    kind = table.get("kind", _USUAL.get(name)) if kind is None else kind
    if text.is_wrong((*owner, "kind")):
        return
    for key, kinds in (_of_lines() if name == "line" else _ONLY.get(name, {})).items():
        if key in table and kind not in kinds:
            text.wrong((*path, key), "D007", f"{key} means nothing for kind = {kind!r}", f"it is for {' and '.join(kinds)}")


def _of_lines() -> Mapping[str, tuple[str, ...]]:
    """Keys of a line that not all kinds of lines have, and the kinds that do."""
    lines = line_kinds().values()
    keys = {key: None for kind in lines for key in (*kind.links, *kind.keys)}
    having = {key: tuple(kind.name for kind in lines if key in kind.links or key in kind.keys) for key in keys}
    return {key: kinds for key, kinds in having.items() if len(kinds) < len(lines)}
