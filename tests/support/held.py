"""How much memory objects hold, counted in objects and in their bytes, so that growth is seen long before it is felt."""

from __future__ import annotations

import gc
import sys
from types import BuiltinFunctionType, CodeType, FrameType, FunctionType, ModuleType
from typing import NamedTuple

_SHARED = (type, ModuleType, CodeType, FrameType, BuiltinFunctionType)
"""Belongs to the program, not to what it does at present."""


class Held(NamedTuple):
    objects: int
    bytes: int


def held(*roots: object) -> Held:
    """What can be reached from ``roots``, each object once. Of functions only what they have closed over counts."""
    gc.collect()
    seen: set[int] = set()
    size = 0
    waiting: list[object] = list(roots)
    while waiting:
        one = waiting.pop()
        if id(one) in seen or isinstance(one, _SHARED):
            continue
        seen.add(id(one))
        size += sys.getsizeof(one)
        waiting += one.__closure__ or () if isinstance(one, FunctionType) else gc.get_referents(one)
    return Held(len(seen), size)
