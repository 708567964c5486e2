"""Messages for users: English sentences with an id and named values, so that a page can give them in another language.

A message is a constant beside the code that uses it, and calling it gives its text::

    WRONG_ROLE = Message("access.wrong-role", "no role {role!r}; roles are {roles}")
    raise Misuse(WRONG_ROLE(role=word, roles=list(ROLES)))

Values are what a user gave or a program measured: they stay as they are in any language. What is to be translated in a message is
itself the text of a message.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any, TypeAlias

JsonValue: TypeAlias = "str | int | float | Sequence[JsonValue] | Mapping[str, JsonValue]"

MESSAGES: dict[str, Message] = {}
"""All messages of the modules that have been imported, by id."""


class MessageText(str):
    """The English text of a message, which knows the message and its values.

    ``id`` is None for a text from elsewhere, such as from the operating system: it is English in every language. ``values`` are
    as in JSON; a message among them is an object with ``text`` and, where it has an id, with ``id`` and ``values``.
    """

    __slots__ = ("id", "values")
    id: str | None
    values: Mapping[str, JsonValue]

    def __new__(cls, text: str, id: str | None = None, values: Mapping[str, JsonValue] | None = None) -> MessageText:  # noqa: A002
        self = super().__new__(cls, text)
        self.id = id
        self.values = {} if values is None else values
        return self

    def __reduce__(self) -> tuple[object, ...]:
        return MessageText, (str(self), self.id, self.values)

    def to_json(self) -> dict[str, JsonValue]:
        """The message as JSON."""
        return {"text": str(self)} if self.id is None else {"text": str(self), "id": self.id, "values": self.values}

    def message(self, name: str) -> MessageText | None:
        """The message among its values with a name; None where there is none."""
        value: Any = self.values.get(name)
        return MessageText(value["text"], value.get("id"), value.get("values")) if isinstance(value, Mapping) else None


class Message:
    """A sentence with places for values, as in `str.format`; a list is shown with commas between its members, ``{lines:\n}``
    with line ends.

    Its id is ``room.what-is-wrong``. Raises `ValueError` for an id that another message has.
    """

    __slots__ = ("english", "id")

    def __init__(self, id: str, english: str) -> None:  # noqa: A002
        if id in MESSAGES:
            raise ValueError(f"two messages have the id {id}")
        self.id, self.english = id, english
        MESSAGES[id] = self

    def __call__(self, /, **values: Any) -> MessageText:
        """The text with these values: texts, numbers, messages, lists of them. Raises `KeyError` for one that is missing."""
        shown = {name: _List(value) if type(value) in (list, tuple) else value for name, value in values.items()}
        return MessageText(self.english.format_map(shown), self.id, {name: _json_value(value) for name, value in values.items()})


class _List(tuple[Any, ...]):
    """A list as messages show it. Its format is what stands between its members."""

    __slots__ = ()

    def __format__(self, between: str) -> str:
        return (between or ", ").join(map(str, self))

    def __str__(self) -> str:
        return ", ".join(map(str, self))

    def __repr__(self) -> str:
        return ", ".join(map(repr, self))


def _json_value(value: Any) -> JsonValue:
    if isinstance(value, MessageText):
        return value.to_json()
    if type(value) in (list, tuple):
        return [_json_value(one) for one in value]
    if isinstance(value, float) and not isfinite(value):
        return str(value)
    return value if isinstance(value, (str, int, float)) else str(value)


NONE = Message("messages.none", "none")
"""Stands for an empty list."""


def text_of(said: BaseException | str) -> MessageText:
    """An error, or a text of this program, to stand in a message: as a message, also without an id."""
    first = said if isinstance(said, str) else said.args[0] if len(said.args) == 1 else None
    return first if isinstance(first, MessageText) else MessageText(str(said))


def with_messages(data: dict[str, Any]) -> dict[str, Any]:
    """A JSON object whose members may be texts of messages or lists of them, with a member ``messages`` where any is.

    ``messages`` has ``id`` and ``values`` by the name of the member; of a list, those of each text.
    """
    found = {name: message for name, value in data.items() if (message := _reference(value)) is not None}
    texts = {name: _as_text(value) for name, value in data.items()}
    return {**texts, "messages": found} if found else texts


def read_message_text(data: Mapping[str, Any], name: str) -> MessageText:
    """The member ``name`` of an object that `with_messages` has made. Raises `LookupError` for another one."""
    reference = data.get("messages", {}).get(name, {})
    return MessageText(data[name], reference.get("id"), reference.get("values"))


def _as_text(value: Any) -> Any:
    if isinstance(value, (list, tuple)):
        return [_as_text(one) for one in value]
    return str(value) if isinstance(value, MessageText) else value


def _reference(value: Any) -> Any:
    if isinstance(value, MessageText):
        return None if value.id is None else {"id": value.id, "values": value.values}
    if isinstance(value, (list, tuple)) and any(isinstance(one, MessageText) for one in value):
        return [_reference(one) for one in value]
    return None
