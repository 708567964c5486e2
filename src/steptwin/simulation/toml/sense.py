"""The keys of a table of a description, and which of them need or exclude each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from steptwin.errors import Misuse
from steptwin.simulation.toml.reader import Key, Path, TomlText
from steptwin.tables import IncompleteTable


@dataclass(frozen=True, slots=True, kw_only=True)
class TableRows:
    """The keys of a table. Raises `IncompleteTable` if a rule names a key that the table does not have."""

    written: str
    """How it is written: ``[[axis.switch]]``."""
    keys: tuple[Key, ...]
    need: Mapping[str, str] = field(default_factory=dict)
    """Keys that mean nothing without another."""
    exclude: tuple[tuple[str, str], ...] = ()
    """Keys that exclude each other: two ways of giving the same value."""
    only: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Keys that some kinds only have: those whose ``kind`` has one of these values."""

    def __post_init__(self) -> None:
        known = {key.name for key in self.keys}
        named = {*self.need, *self.need.values(), *self.only, *(key for pair in self.exclude for key in pair)}
        if strange := sorted(named - known):
            raise IncompleteTable(f"{self.written} has no key {', '.join(strange)}")
        if len(known) < len(self.keys):
            raise Misuse(f"{self.written}: two keys have one name")

    @property
    def attributes(self) -> tuple[str, ...]:
        """The attributes of the specification that the keys are read into."""
        return tuple(key.attribute or key.name for key in self.keys)

    @property
    def usual(self) -> object:
        """The default of the key ``kind``."""
        return next((key.default for key in self.keys if key.name == "kind" and not key.is_required), None)


def check_sense(text: TomlText, path: Path, rows: TableRows, table: object, kind: object = None) -> None:
    """Report keys without effect in a table. ``kind`` is what its keys depend on, unless given there."""
    if not isinstance(table, Mapping):
        return  # reported already
    for key, other in rows.need.items():
        if key in table and other not in table:
            text.means_nothing((*path, key), f"{key} means nothing without {other}")
    for one, other in rows.exclude:
        if one in table and other in table:
            text.wrong((*path, other), "D007", f"{one} and {other} exclude each other")
    owner = path if kind is None else path[:-1]
    kind = table.get("kind", rows.usual) if kind is None else kind
    if text.is_wrong((*owner, "kind")):
        return
    for key, kinds in rows.only.items():
        if key in table and kind not in kinds:
            text.means_nothing((*path, key), f"{key} means nothing for kind = {kind!r}", f"it is for {' and '.join(kinds)}")
