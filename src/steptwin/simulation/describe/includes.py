"""``[[use]]``: tables of another file, with parameters, put into a description; as often as it is needed.

The tables of the file become tables of the description. Names that the file gives, and what refers to them in it, get the name of
the use before them: ``x`` of ``left`` is ``left_x``. ``{length}`` in a text of the file stands for the parameter ``length``; a
text that is nothing else takes its value, of any type.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple, TypeAlias

from steptwin.errors import Misuse
from steptwin.simulation.kinds.registry import KINDS
from steptwin.simulation.toml.keypaths import Path
from steptwin.simulation.toml.reader import TomlText, WorldError, read_table
from steptwin.simulation.toml.table import TableRows, TableSpec, key, table
from steptwin.simulation.toml.values import NameOf, NamesInSpace, PinOf, Word, name_value, text_value

ReadFile: TypeAlias = Callable[[str], bytes]
"""Gives the content of a file that a description names. Raises `Misuse`."""

USE, WITH, PARAMETERS = "use", "with", "parameters"
MOST_INCLUDES = 1000
"""Limit of uses in a description, those in its includes too: each level of includes could double them."""
MOST_NESTED = 8
"""Limit of includes in one another."""
FILE_KEYS = frozenset({"config", "program", "programs", "positions"})
"""Keys of controllers whose values are names of files."""


@table("[[use]]")
class UseSpec(TableSpec):
    name: str = key(name_value, "stands before the names in the file: x of left is left_x")
    file: str = key(text_value, "a file of tables, with defaults of its parameters in [parameters]; values are in [use.with]")


_REFERRING = frozenset(
    {"line", "drive", "feeds", "to", "from", "follows", "when", "until", "expect", "set", "press", "release", "write", "send"}
    | {"put", "remove"}
    | {"power_cycle", "turn", "couple", "machine", "element", "of", "move", "home", "wait_for"}
)
_IDENTIFIER = re.compile(r"(?<![\w.&-])[A-Za-z_][\w-]*")
_PLACEHOLDER = re.compile(r"\{\{|\}\}|\{([^{}]*)\}")


class ReferringKeys(NamedTuple):
    """Keys whose values name controllers, lines and elements, but for those of tables in which a key of that name is a word."""

    names: frozenset[str]
    words: frozenset[tuple[str, str]]
    """Tables, and keys in them."""

    def refers(self, table: Path, key: object) -> bool:
        """``table``: the path of the table that the key is in."""
        kind = next((step for step in reversed(table) if isinstance(step, str)), "")
        return key in self.names and (kind, key) not in self.words


def referring_keys(rows: Mapping[str, TableRows]) -> ReferringKeys:
    keys = [(table, key) for table, of in rows.items() for key in of.keys]
    naming = frozenset(key.name for _, key in keys if isinstance(key.read, PinOf | NameOf | NamesInSpace))
    return ReferringKeys(_REFERRING | naming, frozenset((table, key.name) for table, key in keys if isinstance(key.read, Word)))


def given_files(files: Mapping[str, bytes]) -> ReadFile:
    """Reads from ``files``."""

    def read(name: str) -> bytes:
        if name not in files:
            raise Misuse(f"the content of the file {name!r} is not given with the description")
        return files[name]

    return read


def no_files(name: str) -> bytes:
    return given_files({})(name)


def is_include(text: TomlText) -> bool:
    """Whether a text is for `USE` of another."""
    return PARAMETERS in text.data


class Includes:
    """Puts what a description uses into its data. ``files``: what has been read, with the first place that names it."""

    def __init__(
        self, read: ReadFile, rows: Mapping[str, TableRows], controllers: tuple[str, ...], named: tuple[str, ...]
    ) -> None:
        """``rows``: all tables; ``controllers`` and ``named`` as in `TomlText`."""
        self._read = read
        self._controllers = controllers
        self._rows = rows
        self._named = named
        self._count = 0
        self.files: dict[str, Path] = {}

    def put_into(self, text: TomlText, above: tuple[str, ...] = ()) -> None:
        """Replace the uses in ``text`` by the tables of their files. ``above``: the files in which it is used."""
        uses = text.data.pop(USE, [])
        if not isinstance(uses, list):
            text.stands_once(USE)
            return
        for number, use in enumerate(uses):
            path: Path = (USE, number)
            values = read_table(text, path, use, UseSpec.rows.keys, (WITH,))
            if all(name in values for name in ("name", "file")):
                self._use(text, path, values["name"], values["file"], use.get(WITH, {}), above)

    def _use(self, text: TomlText, path: Path, name: str, file: str, given: object, above: tuple[str, ...]) -> None:
        where = normal(beside(above[-1], file) if above else file)
        try:
            include = self._include(where, above)
        except WorldError as error:
            text.wrong_file((*path, "file"), error)
            text.leave_out_use(name)
            return
        except Misuse as error:
            text.wrong((*path, "file"), "D009", f"file = {file!r}: {error}")
            text.leave_out_use(name)
            return
        self.files.setdefault(where, (*path, "file"))
        text.use(include, path)
        parameters = self._parameters(text, path, include, given)
        include.data = _Instance(include, name, where, parameters, referring_keys(self._rows)).data()
        self.put_into(include, (*above, where))
        for kind, tables in include.data.items():
            self._adopt(text, path, include, kind, tables)

    def _include(self, name: str, above: tuple[str, ...]) -> TomlText:
        """The text of a file. Raises `Misuse` for one that cannot be used, `WorldError` for one that is not TOML."""
        self._count += 1
        if name in above:
            raise Misuse(f"{' uses '.join((*above, name))}, itself")
        if self._count > MOST_INCLUDES or len(above) >= MOST_NESTED:
            raise Misuse(f"permitted are {MOST_INCLUDES} uses, and {MOST_NESTED} in one another")
        try:
            text = self._read(name).decode()
        except UnicodeDecodeError as error:
            raise Misuse(f"cannot read {name}: it is not UTF-8 text") from error
        return TomlText(name, text, self._controllers, self._named)

    @staticmethod
    def _parameters(text: TomlText, path: Path, include: TomlText, given: object) -> dict[str, Any]:
        """The values of parameters; `{}` in the place of a default is none."""
        defaults = include.data.pop(PARAMETERS, {})
        if not isinstance(defaults, Mapping):
            include.wrong((PARAMETERS,), "D002", f"{PARAMETERS} is {defaults!r}", "expected a table")
            defaults = {}
        if not isinstance(given, Mapping):
            text.wrong((*path, WITH), "D002", f"{WITH} is {given!r}", "expected a table")
            given = {}
        for name in given:
            if name not in defaults:
                near = text.near(name, defaults)
                there = f"parameters are {', '.join(defaults)}" if defaults else "it has no [parameters]"
                text.wrong((*path, WITH, name), "D004", f"{include.source.name} has no parameter {name!r}{near}", there)
        values = {**defaults, **{name: value for name, value in given.items() if name in defaults}}
        if lacking := [name for name, value in values.items() if value == {}]:
            text.wrong(path, "D005", f"{include.source.name}: {', '.join(lacking)} is missing", f"expected in [{USE}.{WITH}]")
        return values

    def _adopt(self, text: TomlText, path: Path, include: TomlText, kind: str, tables: Any) -> None:
        """Put the tables of a kind, of an include, into a text."""
        if kind not in self._rows and kind != "fault":
            permitted = [key for key in self._rows if key != "world"]
            include.wrong((kind,), "D004", f"the file has no [{kind}]{include.near(kind, permitted)}")
        elif kind == "world":
            include.wrong((kind,), "D004", "[world] is for the description, not for a file that it uses")
        elif not isinstance(tables, list):
            include.stands_once(kind)
        else:
            there = text.data.setdefault(kind, [])
            if isinstance(there, list):
                for number, table in enumerate(tables):
                    text.adopt((kind, len(there)), include, (kind, number), path)
                    there.append(table)


class _Instance:
    """The data of an include, for one use of it: with its names, files and parameters."""

    def __init__(
        self, include: TomlText, prefix: str, where: str, parameters: Mapping[str, Any], referring: ReferringKeys
    ) -> None:
        self._include = include
        self._prefix = prefix
        self._where = where
        self._parameters = parameters
        self._referring = referring
        self._names = set(_names(include.data))
        self._uses = tuple(f"{name}_" for name in _names({USE: include.data.get(USE)}))

    def data(self) -> dict[str, Any]:
        return {kind: self._value((kind,), value) for kind, value in self._include.data.items()}

    def _value(self, path: Path, value: Any, *, refers: bool = False) -> Any:
        if isinstance(value, dict):
            renamed = path[-1] in ("set", "write")
            return {
                self._text((*path, key), key, refers=renamed): self._value((*path, key), item, refers=self._refers(path, key))
                for key, item in value.items()
            }
        if isinstance(value, list):
            return [self._value((*path, number), item, refers=refers) for number, item in enumerate(value)]
        if not isinstance(value, str):
            return value
        if (whole := _PLACEHOLDER.fullmatch(value)) is not None and whole[1] is not None:
            return self._parameter(path, whole[1])
        if self._names_file(path):
            value = normal(beside(self._where, value))
        return self._text(path, value, refers=refers or self._gives_name(path))

    def _refers(self, path: Path, key: str) -> bool:
        """Whether the value of a key names something in the include."""
        return self._referring.refers(path, key) or path[-1] == WITH or key == "clear_fault"

    @staticmethod
    def _gives_name(path: Path) -> bool:
        return len(path) == 3 and path[2] == "name"

    @staticmethod
    def _names_file(path: Path) -> bool:
        return len(path) > 2 and path[0] in KINDS and path[2] in FILE_KEYS

    def _text(self, path: Path, text: str, *, refers: bool) -> str:
        """With the names of this use, and with parameters as text."""
        parts: list[str] = []
        begin = 0
        for found in _PLACEHOLDER.finditer(text):
            parts.append(self._renamed(text[begin : found.start()]) if refers else text[begin : found.start()])
            parts.append(found[0][0] if found[1] is None else _as_text(self._parameter(path, found[1])))
            begin = found.end()
        rest = text[begin:]
        return "".join((*parts, self._renamed(rest) if refers else rest))

    def _renamed(self, text: str) -> str:
        return _IDENTIFIER.sub(lambda found: self._name(found[0]), text)

    def _name(self, name: str) -> str:
        return f"{self._prefix}_{name}" if name in self._names or name.startswith(self._uses) else name

    def _parameter(self, path: Path, name: str) -> Any:
        if name in self._parameters:
            return self._parameters[name]
        near = self._include.near(name, self._parameters)
        there = f"parameters are {', '.join(self._parameters)}; {{{{ is a brace" if self._parameters else "it has no [parameters]"
        self._include.wrong(path, "D004", f"the file has no parameter {name!r}{near}", there)
        return ""


def _names(data: Mapping[str, Any]) -> Iterator[str]:
    """The names that tables give."""
    for tables in data.values():
        for given in tables if isinstance(tables, list) else ():
            name = given.get("name") if isinstance(given, dict) else None
            if isinstance(name, str) and _PLACEHOLDER.search(name) is None:
                yield name


def _as_text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def beside(file: str, name: str) -> str:
    """The path of a file that another one names, seen from where the path of that one is seen from."""
    is_absolute = name.startswith(("/", "\\")) or name[1:2] == ":"
    folder = "" if is_absolute else file[: max(map(file.rfind, "/\\")) + 1]
    return folder + name


def normal(path: str) -> str:
    """One spelling of a relative path: without ``.`` and with as few ``..`` as possible."""
    parts: list[str] = []
    for part in path.replace("\\", "/").split("/"):
        if part == ".." and parts and parts[-1] not in ("", ".."):
            parts.pop()
        elif part != "." and (part or not parts):
            parts.append(part)
    return "/".join(parts)
