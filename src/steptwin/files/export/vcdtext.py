"""Changes as the text of a value change dump, many at a time.

A change is a moment and a token (the text of the new value, with its line end). The text is built as a matrix of bytes, one
row for each change, in which what must not be printed is 0 and then left out.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Times: TypeAlias = NDArray[np.int64]
Tokens: TypeAlias = NDArray[np.intp]
"""Indices into a list of tokens."""

_BLOCK = 1 << 14
"""Changes worked on at a time: the matrix stays in the cache."""
_WIDEST = 48
"""Longer tokens would make the matrix wide for all: they are put between two of them."""
_GROUP = 4
_GROUPS: NDArray[np.uint8] = np.array([b"%04d" % n for n in range(10**_GROUP)]).view(np.uint8).reshape(-1, _GROUP)
"""The digits of every number of one group."""


def changes_text(times: Times, chosen: Tokens, tokens: list[bytes]) -> list[bytes]:
    """The text, in pieces, of changes in the order of their times. A moment is printed once, before its first change."""
    is_long = np.array([len(token) > _WIDEST for token in tokens])
    table = np.array([b"" if long else token for token, long in zip(tokens, is_long, strict=True)])
    begins = np.empty(len(times), dtype=bool)
    begins[:1] = True
    np.not_equal(times[1:], times[:-1], out=begins[1:])
    # The text of a long token comes after the row of its moment, whose own token is empty.
    cuts = (np.flatnonzero(is_long[chosen]) + 1).tolist() if is_long.any() else []
    pieces: list[bytes] = []
    begin = 0
    for cut in [*cuts, None]:
        end = len(times) if cut is None else cut
        for at in range(begin, end, _BLOCK):
            part = slice(at, min(at + _BLOCK, end))
            pieces.append(_block(times[part], begins[part], table[chosen[part]]))
        if cut is not None:
            pieces.append(tokens[chosen[cut - 1]])
        begin = end
    return pieces


def _block(times: Times, begins: NDArray[np.bool_], values: NDArray[np.bytes_]) -> bytes:
    size, width = len(times), values.dtype.itemsize
    digits = len(str(int(times[-1])))
    groups = -(-digits // _GROUP)
    stamp = 1 + groups * _GROUP + 1
    rows = np.empty((size, stamp + width), dtype=np.uint8)
    rows[:, 0] = ord("#")
    rest = times
    for column in range(1 + (groups - 1) * _GROUP, 0, -_GROUP):
        higher = rest // 10**_GROUP
        rows[:, column : column + _GROUP] = _GROUPS[rest - higher * 10**_GROUP]
        rest = higher
    rows[:, stamp - 1] = ord("\n")
    # Leading zeros: of all numbers, then of the shorter ones.
    least = len(str(int(times[0])))
    rows[:, 1 : 1 + groups * _GROUP - digits] = 0
    for place in range(digits - 1, least - 1, -1):
        rows[times < 10**place, groups * _GROUP - place] = 0
    rows[~begins, :stamp] = 0
    rows[:, stamp:] = values.view(np.uint8).reshape(size, width)
    flat = rows.ravel()
    return flat[flat != 0].tobytes()
