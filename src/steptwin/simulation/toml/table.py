"""Tables of a description as classes. Each key is a field: it is read, checked, documented and completed from there.

```python
@table("[[latch]]")
class LatchSpec(BoardSpec):
    set: Terminal | None = key(OUTPUT_PIN, "output connected to SET", default=None)
```
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from typing import Any, ClassVar, TypedDict, TypeVar, Unpack, cast, dataclass_transform, overload

from steptwin.errors import Misuse
from steptwin.simulation.toml.keypaths import Path
from steptwin.simulation.toml.reader import Key, Row, Table, TomlText, read_table
from steptwin.tables import IncompleteTable

T = TypeVar("T")
D = TypeVar("D")

_KEY, _INNER = "key", "inner"
"""Metadata of fields."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TableRows:
    """The keys of a table and the tables in it. Raises `IncompleteTable` if a rule names a key that the table does not have."""

    written: str
    """Its header: ``[[axis.switch]]``."""
    keys: tuple[Key, ...]
    inner: tuple[InnerTable | NumberedTables, ...] = ()
    need: Mapping[str, str] = field(init=False)
    """Keys that mean nothing without another."""
    exclude: tuple[tuple[str, str], ...] = field(init=False)
    """Keys that exclude each other: two ways of giving the same value."""
    only: Mapping[str, tuple[str, ...]] = field(init=False)
    """Keys that some kinds only have: those whose ``kind`` has one of these values."""
    required: tuple[str, ...] = field(init=False)
    """Fields without a default."""
    inner_names: tuple[str, ...] = field(init=False)
    """Keys of tables in it."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "need", {its.name: its.needs for its in self.keys if its.needs})
        object.__setattr__(self, "only", {its.name: its.kinds for its in self.keys if its.kinds})
        object.__setattr__(self, "exclude", tuple((other, its.name) for its in self.keys for other in its.excludes))
        object.__setattr__(self, "required", tuple(its.attribute or its.name for its in self.keys if its.is_required))
        object.__setattr__(self, "inner_names", tuple(name for one in self.inner for name in one.names))
        known = {its.name for its in self.keys}
        named = {*self.need, *self.need.values(), *self.only, *(name for pair in self.exclude for name in pair)}
        if strange := sorted(named - known):
            raise IncompleteTable(f"{self.written} has no key {', '.join(strange)}")
        if len(known) < len(self.keys):
            raise Misuse(f"{self.written}: two keys have one name")

    @property
    def attributes(self) -> tuple[str, ...]:
        """The fields of the specification that the keys and the tables in it are read into."""
        return (*(key.attribute or key.name for key in self.keys), *(one.attribute for one in self.inner))

    @property
    def usual(self) -> object:
        """The default of the key ``kind``."""
        return next((key.default for key in self.keys if key.name == "kind" and not key.is_required), None)


@dataclass(frozen=True, kw_only=True)
class TableSpec:
    """A table of a description as a value. ``path``: its place in the text."""

    rows: ClassVar[TableRows]
    path: Path = field(default=(), repr=False, compare=False)

    def check(self, text: TomlText) -> None:
        """Report keys that do not fit together."""


S = TypeVar("S", bound=TableSpec)


@dataclass(frozen=True, slots=True)
class InnerTable:
    """A table in a table: ``[axis.encoder]``, or several: ``[[axis.switch]]``."""

    key: str
    spec: type[TableSpec]
    rows: TableRows
    is_list: bool
    attribute: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Its keys in the table around it."""
        return (self.key,)

    @property
    def keys(self) -> tuple[Key, ...]:
        return self.rows.keys

    def read(self, text: TomlText, path: Path, owner: Table, kind: object) -> object:
        """The value of its field. ``path`` and ``kind``: of the table around it."""
        found = tuple(self._those(text, path, owner, kind))
        return found if self.is_list else next(iter(found), None)

    def _those(self, text: TomlText, path: Path, owner: Table, kind: object) -> Iterator[TableSpec]:
        """Those that have all they need."""
        given = owner.get(self.key, [])
        places: Iterable[tuple[Path, object]] = [((*path, self.key), given)] if self.key in owner else []
        if self.is_list:
            places = (((*path, self.key, n), its) for n, its in enumerate(given if isinstance(given, list) else [given]))
        for place, its in places:
            if (found := _read(text, place, self.spec, its, kind)) is not None:
                yield found


@dataclass(frozen=True, slots=True)
class NumberedTables:
    """Tables ``[OWNER.M1]``, ``[OWNER.M2]`` and so on. Their value: by number, the values that are given."""

    prefix: str
    count: int
    keys: tuple[Key, ...]
    attribute: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"{self.prefix}{n}" for n in range(1, self.count + 1))

    def read(self, text: TomlText, path: Path, owner: Table, kind: object) -> Mapping[int, Mapping[str, object]]:
        there = [(n, name) for n, name in enumerate(self.names, start=1) if name in owner]
        found = {n: read_table(text, (*path, name), owner[name], self.keys) for n, name in there}
        return {n: {name: value for name, value in its.items() if value is not None} for n, its in found.items()}


# ---------------------------------------------------------------------- fields


class _Rules(TypedDict, total=False):
    name: str
    """The key, where it is not the name of the field."""
    needs: str
    """The key without which it means nothing."""
    excludes: tuple[str, ...]
    """Keys that give the same value in another way."""
    kinds: tuple[str, ...]
    """The values of the key ``kind`` with which it has a meaning; empty: all."""
    in_space: bool
    """Whether it has a meaning with a place in space only, or without one only."""
    order: int
    """Below 0: before the other keys in documentation and messages, above 0: behind them. Otherwise those of base classes come
    first."""


@overload
def key(read: Callable[[Any], T], meaning: str, **rules: Unpack[_Rules]) -> T: ...
@overload
def key(read: Callable[[Any], T], meaning: str, *, default: D, **rules: Unpack[_Rules]) -> T | D: ...
def key(read: Callable[[Any], Any], meaning: str, *, default: Any = MISSING, order: int = 0, **rules: Any) -> Any:
    """A key of a table, required without a default. ``read`` gives its value, or raises `Misuse` with what is permitted."""
    name = rules.pop("name", "")
    made = Key(name, read, meaning, **({} if default is MISSING else {"default": default}), **rules)
    metadata = {_KEY: made, "order": order}
    return (
        field(default_factory=default.copy, metadata=metadata)
        if isinstance(default, dict)
        else field(default=default, metadata=metadata)
    )


def table_in(name: str, spec: type[S]) -> S | None:
    """The table ``[OWNER.name]``, which may be left out."""
    return field(default=None, metadata={_INNER: InnerTable(name, spec, spec.rows, is_list=False)})  # type: ignore[return-value]


def tables_in(name: str, spec: type[S], written: str = "") -> tuple[S, ...]:
    """The tables ``[[OWNER.name]]``. ``written``: their header, where that of ``spec`` has another owner."""
    rows = replace(spec.rows, written=written) if written else spec.rows
    return field(default=(), metadata={_INNER: InnerTable(name, spec, rows, is_list=True)})  # type: ignore[return-value]


def numbered_tables_in(prefix: str, count: int, keys: Iterable[Key]) -> Mapping[int, Mapping[str, Any]]:
    """The tables ``[OWNER.prefix1]`` to ``count``, which may be left out, as may their ``keys``: default None."""
    return field(default_factory=dict, metadata={_INNER: NumberedTables(prefix, count, tuple(keys))})


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(key, table_in, tables_in, numbered_tables_in))
def table(written: str = "") -> Callable[[type[T]], type[T]]:
    """Make the frozen dataclass of a table of its fields, with its ``rows``. ``written``: its header, none for a base class."""

    def make(spec: type[T]) -> type[T]:
        made = dataclass(frozen=True, kw_only=True)(spec)
        cast("type[TableSpec]", made).rows = TableRows(written=written, keys=_keys(made), inner=_inner(made))
        return made

    return make


def _keys(spec: type[Any]) -> tuple[Key, ...]:
    having = sorted((one for one in fields(spec) if _KEY in one.metadata), key=lambda one: one.metadata["order"])
    named: Iterable[tuple[str, Key]] = ((one.name, one.metadata[_KEY]) for one in having)
    return tuple(replace(its, name=its.name or name, attribute=name if its.name else "") for name, its in named)


def _inner(spec: type[Any]) -> tuple[InnerTable, ...]:
    return tuple(replace(one.metadata[_INNER], attribute=one.name) for one in fields(spec) if _INNER in one.metadata)


# ---------------------------------------------------------------------- reading


def read_row(text: TomlText, path: Path, rows: TableRows, given: object) -> dict[str, Any] | None:
    """The values of the keys of a table by field; None without a required one."""
    values = read_table(text, path, given, rows.keys, rows.inner_names)
    return values if all(name in values for name in rows.required) else None


def read_spec(text: TomlText, path: Path, spec: type[S], given: object, **others: object) -> S | None:
    """The value of a table; None without a required key. Errors are added to ``text``. ``others``: fields that are no keys."""
    return _read(text, path, spec, given, None, **others)


def _read(text: TomlText, path: Path, spec: type[S], given: object, kind: object, **others: object) -> S | None:
    row = read_row(text, path, spec.rows, given)
    if row is None:
        return None
    check_cross_fields(text, path, spec.rows, given, kind)
    return make_spec(text, spec, row | {"path": path, **others}, given if isinstance(given, Mapping) else {})


def make_spec(text: TomlText, spec: type[S], row: Row, given: Table) -> S:
    """The value of a table whose keys are read already. The tables in it are read, and what does not fit together is reported."""
    values = dict(row)
    if spec.rows.inner:
        kind = given.get("kind", spec.rows.usual)
        values |= {one.attribute: one.read(text, row["path"], given, kind) for one in spec.rows.inner}
    made = spec(**values)
    made.check(text)
    return made


def check_cross_fields(text: TomlText, path: Path, rows: TableRows, given: object, kind: object = None) -> None:
    """Report keys without effect in a table. ``kind``: that of the table around it, for one without a kind of its own."""
    if not isinstance(given, Mapping):
        return  # reported already
    for name, other in rows.need.items():
        if name in given and other not in given:
            text.means_nothing((*path, name), f"{name} means nothing without {other}")
    for one, other in rows.exclude:
        if one in given and other in given:
            text.wrong((*path, other), "D007", f"{one} and {other} exclude each other")
    if not rows.only:
        return
    has_kind = any(its.name == "kind" for its in rows.keys)
    if has_kind:
        kind = given.get("kind", rows.usual)
    if text.is_wrong((*(path if has_kind else path[:-1]), "kind")):
        return
    for name, kinds in rows.only.items():
        if name in given and kind not in kinds:
            text.means_nothing((*path, name), f"{name} means nothing for kind = {kind!r}", f"it is for {' and '.join(kinds)}")
