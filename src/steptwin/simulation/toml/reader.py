"""Reads tables of TOML against rows that define what is permitted. All errors are reported, with file, line and key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias, TypeVar

from steptwin.diagnostics import Diagnostic, Fix, Severity, SourceText, Span, in_order, render
from steptwin.errors import Misuse, SourceErrors
from steptwin.nearmiss import NearMiss
from steptwin.simulation.toml.keypaths import Path, UnsupportedToml, find_spans
from steptwin.simulation.toml.names import Unknown, UnknownSignal, WrongTerminal
from steptwin.simulation.toml.values import Word

T = TypeVar("T")

_MISSING: Any = object()
MOST_FINDINGS = 100
"""Most errors that are reported."""
_LONGEST_MESSAGE = 400
_WHOLE = range(-(1 << 63), 1 << 63)
_MANY_DIGITS = re.compile(r"(?:[0-9A-Fa-f]_?){16}")
"""Digits that a number of more than 64 bits has."""


FILE_ERRORS = "D010"
"""A file that the description names has errors."""


Table: TypeAlias = Mapping[str, Any]
"""A table as written in the text."""
Row: TypeAlias = Mapping[str, Any]
"""The values of a table by attribute, each read and checked, with the ``path`` of the table."""


class WorldError(SourceErrors):
    """A description of a world with errors; the text shows them all."""

    def __init__(self, source: SourceText, findings: Sequence[Diagnostic], in_files: Sequence[str] = ()) -> None:
        """``in_files`` are the errors in files that the description names, rendered; they stand for its own `FILE_ERRORS`."""
        self.source = source
        self.findings = in_order(findings)
        own = [finding for finding in self.findings if finding.code != FILE_ERRORS]
        super().__init__("\n".join([*in_files, *([render(source, own)] if own else [])]))


class Adopted(NamedTuple):
    """A table that comes from another text: there, and the use of that text here."""

    text: TomlText
    path: Path
    use: Path


class TomlText:
    """A TOML text that knows where its keys are, and collects what is wrong with them.

    Some of its tables may come from other texts, which it uses; what is wrong with these is shown where it is, and where they are
    used.
    """

    def __init__(self, name: str, text: str, controllers: Sequence[str] = (), named: Sequence[str] = ()) -> None:
        """``controllers`` are the tables that describe one, ``named`` the others with names that tables refer to. Raises
        `WorldError` for a text that is not TOML."""
        self.source = SourceText(name, text)
        self.controllers = tuple(controllers)
        self.named = (*named, *controllers)
        self.findings: list[Diagnostic] = []
        """Errors."""
        self.warnings: list[Diagnostic] = []
        self._in_files: list[str] = []
        """Errors in files that the description names, rendered."""
        self._near = NearMiss()
        self._spans: Mapping[Path, Span] = {}
        self._wrong: set[Path] = set()
        """Errors in the order of their reports; tables of these are not checked further."""
        self._left_out: set[str] = set()
        self._left_out_uses: tuple[str, ...] = ()
        """Beginnings of names from uses with errors."""
        self._adopted: dict[Path, Adopted] = {}
        self._used: tuple[TomlText, Path] | None = None
        """The text that uses this one, and where."""
        try:
            self._spans, data, wrong = _parsed(text)
        except UnsupportedToml as error:
            self.wrong_at(error.span, "D001", str(error))
            raise self.error() from None
        except tomllib.TOMLDecodeError as error:
            place = re.search(r"line (\d+), column (\d+)", str(error))
            start = len(text)
            if place is not None:
                lines = text.splitlines(keepends=True)
                start = min(sum(map(len, lines[: int(place[1]) - 1])) + int(place[2]) - 1, len(text))
            message = str(error).split(" (at ")[0]
            self.wrong_at(Span(start, min(start + 1, len(text))), "D001", f"this is not TOML: {message}")
            raise self.error() from None
        self.data: dict[str, Any] = _copied(data)
        if wrong is not None:
            self.wrong(wrong, "D001", "a whole number of more than 64 bits")
            raise self.error()

    def wrong_at(self, span: Span, code: str, message: str, hint: str | None = None, fix: Fix | None = None) -> None:
        """Raises `WorldError` when there is more wrong than anybody reads."""
        if len(message) > _LONGEST_MESSAGE and "\n" not in message:
            message = f"{message[: _LONGEST_MESSAGE - 61]}…{message[-60:]}"
        found = Diagnostic(code, Severity.ERROR, span, message, hint, fix)
        self.findings.append(found)
        if code != FILE_ERRORS:
            self._tell_user(render(self.source, [found]))
        if len(self.findings) >= MOST_FINDINGS:
            raise self.error()

    def wrong(self, path: Path, code: str, message: str, hint: str | None = None, fix: Fix | None = None) -> None:
        """Something is wrong with the value at ``path``, or with what holds it."""
        self._wrong.add(path)
        adopted = self._adopted.get(path[:2])
        if adopted is not None and code != FILE_ERRORS:
            adopted.text.wrong((*adopted.path, *path[2:]), code, message, hint)
            return
        if adopted is not None:
            path = adopted.use
        self.wrong_at(self._span(path), code, message, hint, fix)

    def warn(self, path: Path, code: str, message: str, hint: str | None = None) -> None:
        """The value at ``path``, or what holds it, is permitted but doubtful; of another text it is shown at its use."""
        adopted = self._adopted.get(path[:2])
        span = self._span(path if adopted is None else adopted.use)
        self.warnings.append(Diagnostic(code, Severity.WARNING, span, message, hint))

    def _span(self, path: Path) -> Span:
        if (*path, 0) in self._spans and path not in self._spans:
            path = *path, 0
        while path and path not in self._spans:
            path = path[:-1]
        return self._spans.get(path, Span(0, 0))

    def unless_wrong(self, path: Path, action: Callable[[], T]) -> T | None:
        """Result of ``action`` for the table at ``path``; None if that has an error already, or now. Errors are reported at the
        path."""
        if self.is_wrong(path):
            return None
        try:
            return action()
        except SourceErrors as error:
            self.wrong_file(path, error)
        except Misuse as error:
            self.wrong_reference(path, error)
        return None

    def wrong_file(self, path: Path, error: SourceErrors) -> None:
        """A file that the table at ``path`` names has errors, which have places of their own."""
        if str(error) not in self._in_files:
            self._in_files.append(str(error))
        self.wrong(path, FILE_ERRORS, f"a file has errors: {str(error).splitlines()[0]}")

    # ------------------------------------------------------------------ tables of other texts

    def use(self, other: TomlText, path: Path) -> None:
        """Tables of another text will be adopted, for what is at ``path``."""
        other._used = self, path

    def adopt(self, here: Path, other: TomlText, there: Path, use: Path) -> None:
        """The table at ``here`` is that at ``there`` in another text, which is used at ``use``."""
        self._adopted[here] = Adopted(other, there, use)

    def leave_out_use(self, name: str) -> None:
        """Note that names of a use are not there, because of what is wrong with it."""
        self._left_out_uses = (*self._left_out_uses, f"{name}_")

    def _tell_user(self, shown: str) -> None:
        """Report something wrong in this text to the one that uses it."""
        if self._used is None:
            return
        user, path = self._used
        place = f"{shown}\n  used in {user.source.name}:"
        same = next((number for number, known in enumerate(user._in_files) if known.startswith(place)), None)
        shown = f"{place}{user.line(path)}"
        if same is None:
            user._in_files.append(shown)
        else:
            user._in_files[same] += f", {user.line(path)}"
        user.wrong(path, FILE_ERRORS, f"a file has errors: {shown.splitlines()[0]}")
        user._tell_user(shown)

    def wrong_reference(self, path: Path, error: Misuse, place: str = "") -> None:
        """Report that the value at ``path`` does not fit the rest. Not reported where it only follows from something else that
        is wrong; then what the table would have been is not there either."""
        named = error if isinstance(error, Unknown | UnknownSignal | WrongTerminal) else None
        if not (isinstance(error, Unknown) and self.may_be_broken(error.name)):
            path = path if named is None else self._key_with(path, named.name)
            fix = None if named is None else self.replacement(path, named.name, named.meant)
            self.wrong(path, "D009", f"{place}{error}", fix=fix)
        elif len(path) > 1 and (name := self._name_of(path[0], path[1])) is not None:
            self.leave_out(name)

    def _key_with(self, path: Path, name: str) -> Path:
        """The key of the table at ``path``, or of a table in it, whose text has a name, if exactly one has it; else ``path``."""
        table = self._given(path)
        if not isinstance(table, dict):
            return path
        keys = [key for key, value in table.items() if any(name.lower() in text.lower() for text in _texts(value))]
        if not keys:
            inner = [(*path, key) for key, value in table.items() if isinstance(value, dict)]
            found = [key for table_in in inner if (key := self._key_with(table_in, name)) != table_in]
            return found[0] if len(found) == 1 else path
        return (*path, keys[0]) if len(keys) == 1 else path

    def _name_of(self, kind: str | int, number: str | int) -> str | None:
        """The name in a table that may be several times."""
        tables = self.data.get(str(kind))
        table = tables[number] if isinstance(tables, list) and isinstance(number, int) else None
        found = table.get("name") if isinstance(table, dict) else None
        return found if isinstance(found, str) else None

    def is_given(self, path: Path) -> bool:
        """Whether the text has a value at ``path``."""
        return self._given(path) is not _MISSING

    def _given(self, path: Path) -> Any:
        """The value at ``path``; `_MISSING` where there is none. A table may stand for a list of one."""
        found: Any = self.data
        for step in path:
            if isinstance(found, dict) and step != 0:
                found = found.get(step, _MISSING)
            elif isinstance(found, list):
                found = found[step] if isinstance(step, int) and step < len(found) else _MISSING
        return found

    def is_wrong(self, path: Path) -> bool:
        """Whether something is wrong with the value at ``path`` or in it."""
        return bool(self._wrong) and any(wrong[: len(path)] == path for wrong in self._wrong)

    def is_any_wrong(self, *kinds: str) -> bool:
        """Whether something is wrong with tables of these kinds."""
        return any(wrong[0] in kinds for wrong in self._wrong if wrong)

    def leave_out(self, name: str) -> None:
        """Note that nothing with this name is built, because of what is wrong elsewhere."""
        self._left_out.add(name)

    def leave_out_all(self, kind: str) -> None:
        """Nothing in the tables called ``kind`` is built, because there is no such kind."""
        tables = self.data[kind]
        for number in range(len(tables) if isinstance(tables, list) else 0):
            if (name := self._name_of(kind, number)) is not None:
                self.leave_out(name)

    def may_be_broken(self, name: str) -> bool:
        """Whether this is the name of a table with something wrong in it, or may be, because such a table has none."""
        if name in self._left_out or name.startswith(self._left_out_uses):
            return True
        for kind, number in {(wrong[0], wrong[1]) for wrong in self._wrong if len(wrong) > 1}:
            found = self._name_of(kind, number)
            if found == name or (kind in self.named and found is None):
                return True
        return False

    def where(self, path: Path) -> str:
        """The line of a value, or of what holds it: ``line 12``, of another text with its name."""
        line, name = self.place(path)
        return f"line {line}" if name is None else f"line {line} of {name}"

    def place(self, path: Path) -> tuple[int, str | None]:
        """The line (from 1) of a value, or of what holds it, and the name of the text where that is another one."""
        adopted = self._adopted.get(path[:2])
        if adopted is None:
            return self.line(path), None
        line, name = adopted.text.place((*adopted.path, *path[2:]))
        return line, name or adopted.text.source.name

    def use_of(self, path: Path) -> int | None:
        """The line of the use that puts a table of another text here; None where the table is of this text."""
        adopted = self._adopted.get(path[:2])
        return None if adopted is None else self.line(adopted.use)

    def line(self, path: Path) -> int:
        """The line (from 1) of a value, or of what holds it."""
        while path and path not in self._spans:
            path = path[:-1]
        return self.source.position(self._spans[path].start)[0] if path else 1

    def meant(self, word: str, known: Iterable[str]) -> str | None:
        """The known word that was probably meant."""
        return self._near.of(word, known)

    def near(self, word: str, known: Iterable[str]) -> str:
        return self._near.hint(word, known)

    def key_replacement(self, path: Path, name: str, known: Iterable[str]) -> Fix | None:
        """The fix that puts the key that was probably meant in the place of the one at ``path``."""
        span, meant = self._spans.get(path), self.meant(name, known)
        if span is None or meant is None:
            return None
        begin = self.source.text.find(name, span.start, span.end)
        return None if begin < 0 else Fix(Span(begin, begin + len(name)), meant)

    def replacement(self, path: Path, old: str, new: str | None) -> Fix | None:
        """The fix that puts a word in the place of the last such in what is at ``path``: its key or its text."""
        span = self._spans.get(path)
        begin = -1 if span is None else self.source.text.rfind(old, span.start, span.end)
        return None if begin < 0 or new is None else Fix(Span(begin, begin + len(old)), new)

    def doubled(self, name: str) -> Fix | None:
        """The fix that writes ``[[name]]`` for ``[name]``."""
        found = re.search(rf"^[ \t]*(\[[ \t]*{re.escape(name)}[ \t]*\])(?!\])", self.source.text, re.MULTILINE)
        return None if found is None else Fix(Span(*found.span(1)), f"[{found[1]}]")

    def removal(self, path: Path) -> Fix | None:
        """The fix that removes a key with its value, if it has a line of its own."""
        span, text = self._spans.get(path), self.source.text
        if span is None:
            return None
        start, end = text.rfind("\n", 0, span.start) + 1, text.find("\n", span.end)
        before, after = text[start : span.start], text[span.end : end if end >= 0 else None]
        is_alone = not before.strip() and not after.strip()
        return Fix(Span(start, end + 1 if end >= 0 else len(text)), "") if is_alone else None

    def means_nothing(self, path: Path, message: str, hint: str | None = None) -> None:
        """The key at ``path`` has no effect beside the others."""
        self.wrong(path, "D007", message, hint, self.removal(path))

    def stands_once(self, name: str) -> None:
        """There may be several tables ``name``."""
        self.wrong(
            (name,), "D002", f"[{name}] is a single table", f"expected [[{name}]], for there may be several", self.doubled(name)
        )

    def error(self) -> WorldError:
        return WorldError(self.source, self.findings, self._in_files)

    def check(self) -> None:
        """`WorldError` if anything was wrong."""
        if self.findings:
            raise self.error()


@lru_cache(maxsize=8)
def _parsed(text: str) -> tuple[Mapping[Path, Span], dict[str, Any], Path | None]:
    """The spans and values of a text, and its first number that is too long. They are remembered, for a campaign reads one text
    for each of its runs; nothing may change them."""
    spans, data = find_spans(text), tomllib.loads(text)
    return spans, data, next(_long_numbers((), data), None) if _MANY_DIGITS.search(text) else None


def _long_numbers(path: Path, value: object) -> Iterator[Path]:
    """TOML's whole numbers have 64 bits; `tomllib` takes any."""
    if isinstance(value, dict):
        for name, item in value.items():
            yield from _long_numbers((*path, name), item)
    elif isinstance(value, list):
        for number, item in enumerate(value):
            yield from _long_numbers((*path, number), item)
    elif isinstance(value, int) and value not in _WHOLE:
        yield path


def _texts(value: object) -> Iterator[str]:
    """A text, or those of a list."""
    yield from (one for one in (value if isinstance(value, list) else [value]) if isinstance(one, str))


def _copied(value: Any) -> Any:
    """A copy of tables and arrays."""
    if isinstance(value, dict):
        return {key: _copied(item) if isinstance(item, dict | list) else item for key, item in value.items()}
    return [_copied(item) if isinstance(item, dict | list) else item for item in value]


# ---------------------------------------------------------------------- rows


@dataclass(frozen=True, slots=True)
class Key:
    """A key of a table: how its value is read (raising `Misuse` with what is permitted), and what holds without it."""

    name: str
    read: Callable[[Any], Any]
    meaning: str
    default: Any = _MISSING
    attribute: str = ""
    """The attribute it becomes, where that is not its name."""
    needs: str = ""
    """The key without which it means nothing."""
    excludes: tuple[str, ...] = ()
    """Keys that give the same value in another way."""
    kinds: tuple[str, ...] = ()
    """The values of the key ``kind`` with which it has a meaning; empty: all."""
    in_space: bool | None = None
    """Whether it has a meaning with a place in space only, or without one only; None: with and without."""
    is_required: bool = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "is_required", self.default is _MISSING)

    @property
    def permitted(self) -> str:
        """Permitted values in words; empty where what reads it does not say."""
        return getattr(self.read, "permitted", "")


COMMON_WORDS: Mapping[str, tuple[str, ...]] = {
    "lead": ("pitch",),
    "screw": ("pitch",),
    "limits": ("travel",),
    "range": ("travel",),
    "stops": ("travel",),
    "play": ("backlash",),
    "motor": ("drive",),
    "position": ("at", "start"),
    "input": ("to", "in"),
    "pin": ("to",),
    "output": ("extend", "run", "release", "coil", "from"),
    "velocity": ("speed", "vel"),
    "weight": ("force", "mass"),
    "delay": ("time",),
    "condition": ("when", "until"),
}
"""Usual words for keys that have other names here."""


def read_table(text: TomlText, path: Path, value: object, keys: Sequence[Key], also: Iterable[str] = ()) -> dict[str, Any]:
    """The values of a table by attribute; errors are added to ``text``. Keys in ``also`` are read elsewhere."""
    values: dict[str, Any] = {key.attribute or key.name: key.default for key in keys if not key.is_required}
    if not isinstance(value, Mapping):
        text.wrong(path, "D002", f"{_what(path)} is {value!r}", "expected a table")
        return values
    known = {key.name: key for key in keys}
    permitted = [*known, *also]
    for name, given in value.items():
        key = known.get(name)
        if key is not None:
            try:
                values[key.attribute or key.name] = key.read(given)
            except Misuse as error:
                meant = key.read.near(given) if isinstance(key.read, Word) else None
                fix = text.replacement((*path, name), str(given), meant)
                text.wrong((*path, name), "D003", f"{_what(path)}: {name}: {error}", key.meaning, fix)
        elif name not in also:
            usual = next((key for key in COMMON_WORDS.get(name.lower(), ()) if key in permitted), None)
            near = text.near(name, permitted) if usual is None else f" (did you mean {usual!r}?)"
            fix = text.key_replacement((*path, name), name, permitted)
            text.wrong((*path, name), "D004", f"{_what(path)} has no {name!r}{near}", f"permitted: {_listed(known, also)}", fix)
    for key in keys:
        if key.is_required and key.name not in value:
            text.wrong(path, "D005", f"{_what(path)}: {key.name} is missing", key.meaning)
    return values


def _listed(known: Iterable[str], also: Iterable[str]) -> str:
    """Keys for messages; of numbered tables, such as those of the inputs of a controller, the first and last."""
    numbered: dict[str, list[str]] = {}
    for name in also:
        numbered.setdefault(name.rstrip("0123456789"), []).append(name)
    return ", ".join([*known, *(" to ".join(dict.fromkeys((names[0], names[-1]))) for names in numbered.values())])


def _what(path: Path) -> str:
    names = [str(part) for part in path if isinstance(part, str)]
    return f"[{'.'.join(names)}]" if names else "the file"
