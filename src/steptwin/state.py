"""Plain state that can be copied out of a controller and put back: snapshots.

A controller and its parts keep their state in slots, so that a new attribute cannot be forgotten. What is not a state -
configuration, hooks, the controller a part belongs to - is in ``FIXED``, which is a part of the slots:
``__slots__ = (*FIXED, "position")``.
"""

from __future__ import annotations

from array import array
from collections import deque
from typing import Any, ClassVar, TypeAlias, TypeGuard

Plain: TypeAlias = tuple[Any, ...]
"""State of a `Stateful` object: immutable values, containers of them, and the `Plain` state of its parts."""


class Stateful:
    """Base of objects made of plain state and `Stateful` parts (single, or in a tuple).

    Lists, dictionaries, deques, arrays and bytearrays are copied and hold immutable values; all other values are immutable and
    shared.
    """

    __slots__ = ()

    FIXED: ClassVar[tuple[str, ...]] = ()
    """Slots of a class that are not copied, besides those of its bases."""
    _STATE: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        bases = [vars(base) for base in reversed(cls.__mro__)]
        fixed = {name for base in bases for name in base.get("FIXED", ())}
        cls._STATE = tuple(name for base in bases for name in base.get("__slots__", ()) if name not in fixed)

    def copy_state(self) -> Plain:
        """A copy of the state that shares nothing that changes."""
        return tuple(_copied(getattr(self, name)) for name in self._STATE)

    def set_state(self, plain: Plain) -> None:
        """Take the state of an object of the same structure; ``plain`` stays as it is."""
        for name, value in zip(self._STATE, plain, strict=True):
            part = getattr(self, name)
            if isinstance(part, Stateful):
                part.set_state(value)
            elif _is_parts(part):
                for one, its_value in zip(part, value, strict=True):
                    one.set_state(its_value)
            else:
                setattr(self, name, _copied(value))


def _is_parts(value: object) -> TypeGuard[tuple[Stateful, ...]]:
    return type(value) is tuple and len(value) > 0 and isinstance(value[0], Stateful)


def _copied(value: object) -> object:
    if isinstance(value, Stateful):
        return value.copy_state()
    if isinstance(value, list | dict | deque | bytearray):
        return value.copy()
    if isinstance(value, array):
        return value[:]
    if _is_parts(value):
        return tuple(part.copy_state() for part in value)
    return value
