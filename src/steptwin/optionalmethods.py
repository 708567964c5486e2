"""Interfaces that have methods which only some of their classes override."""

from __future__ import annotations

from collections.abc import Callable


class OptionalMethods:
    """Base class of such an interface."""

    def offers(self, method: Callable[..., object], /) -> bool:
        """Whether the class of this object overrides a method of the interface, given as `Interface.method`.

        Raises `TypeError` for a method of an object, which is always the one that the object has.
        """
        if hasattr(method, "__self__"):
            raise TypeError(f"{method.__qualname__} of an object: name it with the interface")
        return getattr(type(self), method.__name__) is not method
