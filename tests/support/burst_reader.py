"""A reader of RTU bursts, written from the rule of MIC-15 and not from the framer: simple, slow, one whole burst at a time."""

from __future__ import annotations

from steptwin.controller import MICROSECOND, MILLISECOND, SECOND

UNIT = 1
GAP = 20 * MILLISECOND
CHARACTER = 260 * MICROSECOND


def checksum(data: bytes) -> bytes:
    """CRC of Modbus over serial line V1.02, appendix B, bit by bit."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return bytes((crc & 0xFF, crc >> 8))


def is_right(frame: bytes) -> bool:
    return 4 <= len(frame) <= 256 and checksum(frame[:-2]) == frame[-2:]


_COUNTED_REQUEST = {15: (9, 6), 16: (9, 6), 20: (5, 2), 21: (5, 2), 23: (13, 10)}
_PLAIN_REQUEST = {1: 8, 2: 8, 3: 8, 4: 8, 5: 8, 6: 8, 7: 4, 8: 8, 11: 4, 12: 4, 17: 4, 22: 10, 24: 6, 43: 7}
_COUNTED_RESPONSE = {**dict.fromkeys((1, 2, 3, 4, 12, 17, 20, 21, 23), (5, 2)), 24: (6, 3)}
_PLAIN_RESPONSE = {5: 8, 6: 8, 7: 5, 8: 8, 11: 8, 15: 8, 16: 8, 22: 10}


def ends(data: bytes) -> list[int | None]:
    """The lengths that the frame at the beginning of ``data`` may have; None while the byte with the length is missing."""
    if data[0] > 247:
        return []
    if len(data) < 2:
        return [None]
    function, found = data[1], []
    tables = [(_COUNTED_REQUEST, _PLAIN_REQUEST)]
    if data[0] not in (0, UNIT):
        tables.append((_COUNTED_RESPONSE, {**_PLAIN_RESPONSE, **dict.fromkeys(range(0x81, 0x100), 5)}))
    for counted, plain in tables:
        if function in counted:
            least, place = counted[function]
            found.append(least + data[place] if len(data) > place else None)
        elif function in plain:
            found.append(plain[function])
    return [length for length in found if length is None or length <= 256]


class BurstReader:
    """The frames of a line on which `UNIT` listens."""

    def __init__(self) -> None:
        self.frames: list[bytes] = []
        self._held = b""
        self._pauses: list[int] = []  # before each byte
        self._silent: set[int] = set()  # places in front of which a frame has ended or a burst has begun
        self._data_until = 0

    def burst(self, data: bytes, pauses: list[int], silence_before: int, silence_after: int) -> None:
        """A whole burst; ``pauses`` has the silence before each of its bytes, 0 for the first."""
        if silence_before > 2 * SECOND:
            self._cut(len(self._held))
        self._silent.add(len(self._held))
        self._held += data
        self._pauses += [silence_before, *pauses[1:]]
        self._search(None)
        self._cut(self._search(silence_after))

    def _search(self, silence: int | None) -> int:
        """Take the frames, as they come (None) or with the silence after the burst. Returns the place that may be unfinished."""
        place = 0
        while place < len(self._held):
            length = self._frame(place, is_over=silence is not None)
            if length == 0 and silence is not None and (chosen := self._abandoned_for(place, silence)) is not None:
                place, length = chosen, self._frame(chosen, is_over=True)
            if length == 0:
                break
            if length < 0 and place in self._silent:
                known = [end for end in ends(self._held[place:]) if end is not None]
                self._data_until = max([self._data_until, *(place + end for end in known)])
            if length < 0 or (place not in self._silent and place + length <= self._data_until):
                place += 1
                continue
            self.frames.append(self._held[place : place + length])
            self._cut(place + length)
            self._silent.add(0)
            place = 0
        return place

    def _cut(self, count: int) -> None:
        self._held, self._pauses = self._held[count:], self._pauses[count:]
        self._silent = {place - count for place in self._silent if place >= count}
        self._data_until -= count

    def _frame(self, place: int, *, is_over: bool = True) -> int:
        """Length of the frame at ``place``; 0 if its end may be still to come, -1 if there is none."""
        rest = self._held[place:]
        lengths = ends(rest)
        right = [length for length in lengths if length is not None and length <= len(rest) and is_right(rest[:length])]
        if right:
            return min(right)
        if is_over and place == max(self._silent, default=-1) and is_right(rest):
            return len(rest)
        return 0 if any(length is None or length > len(rest) for length in lengths) else -1

    def _abandoned_for(self, unfinished: int, silence: int) -> int | None:
        """The place of a new request for which the frame at ``unfinished`` is given up when nothing comes for ``silence``."""
        waits = []
        for place in sorted(self._silent):
            if place <= unfinished or (length := self._frame(place)) <= 0:
                continue
            wait, end = 0, place + length
            for pause in self._pauses[place + 1 : end]:
                wait = max(wait, pause if pause >= GAP else 0)
            while end < len(self._held) and (more := self._frame(end)) > 0:
                end += more
            waits.append((GAP + (200 * MILLISECOND if end < len(self._held) else min(wait, 200 * MILLISECOND)), place))
        return min(((wait, place) for wait, place in waits if wait <= silence), default=(0, None))[1]
