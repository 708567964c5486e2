"""Keys of a description that mean nothing where they stand, beside or without others."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.world.reader import Path, Text

_NEED: Mapping[str, Mapping[str, str]] = {
    "switch": {"width": "position", "period": "position", "bounces": "bounce"},
    "button": {"bounces": "bounce"},
    "encoder": {"offset": "index", "index_width": "index"},
    "event": {"once": "when"},
}
"""Keys that mean nothing without another."""
_EXCLUDE: Mapping[str, tuple[tuple[str, str], ...]] = {
    "mic488": (("program", "programs"),),
    "axis": (("pulses_per_unit", "pitch"),),
    "encoder": (("counts_per_rev", "counts_per_unit"),),
}
"""Keys that say the same in two ways."""
_ONLY: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "line": {"rtu_tcp": ("modbus",), "gap": ("modbus",)},
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


def check_sense(text: Text, path: Path, name: str, table: object, kind: object = None) -> None:
    """Tell what means nothing in a table called ``name``. ``kind`` is what its keys depend on, where it does not say itself."""
    if not isinstance(table, Mapping):
        return  # told already
    for key, other in _NEED.get(name, {}).items():
        if key in table and other not in table:
            text.wrong((*path, key), "D007", f"{key} means nothing without {other}")
    for one, other in _EXCLUDE.get(name, ()):
        if one in table and other in table:
            text.wrong((*path, other), "D007", f"{one} and {other} exclude each other")
    owner = path if kind is None else path[:-1]
    kind = table.get("kind", _USUAL.get(name)) if kind is None else kind
    if text.is_wrong((*owner, "kind")):
        return
    for key, kinds in _ONLY.get(name, {}).items():
        if key in table and kind not in kinds:
            text.wrong((*path, key), "D007", f"{key} means nothing for kind = {kind!r}", f"it is for {' and '.join(kinds)}")
