"""Record of a world, exact and compact: profiles instead of pulses, edges instead of samples.

Each controller's records come in the order in which they happened to it. Controllers that share a scheduler are advanced
together, so their records are merged by (time, order in which they happened): a cause stands before its effect of the same
nanosecond. Controllers of several schedulers are advanced apart from each other; theirs are merged by (time, order of the
schedulers).

Values by kind: ``plan`` the new `Profile` of an axis (subject ``"1"``…), in pulses, or the `StepTrain` of one that does not give
a pulse for every unit of position; ``load`` where the load of an axis is until the next such record: tuples (moment, whether it
goes with the pulses of the drive, how many pulses from them, or else at which), before the first record with them; ``coordinate``
by how many pulses POS_ACT of an axis is above its count from now on (0 before the first record); ``edge`` the
new level of a pin, input or output (0.0, 1.0 or volts); ``frame`` the bytes of a frame (subject link and direction,
``"tcp-1/in"``); ``statement`` the number of the line a program executes (subject: program); ``event`` a text (subject: its
code); ``input`` what came from outside (subject: what was done); ``fault`` a text (subject: its name).
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from hashlib import blake2b
from heapq import merge
from itertools import islice
from operator import itemgetter
from typing import Any, NamedTuple, TypeAlias

from steptwin.controller import Fact, Nanos
from steptwin.errors import Misuse
from steptwin.motion import Profile, Segment
from steptwin.motion.divisions import Plan, StepTrain
from steptwin.motion.paths import ArcSegment

KINDS = ("plan", "load", "free", "coordinate", "edge", "frame", "statement", "event", "input", "fault")
DIGEST_BYTES = 16


class TraceRecord(NamedTuple):
    """A record of a trace."""

    time: Nanos
    controller: str
    kind: str
    subject: str
    value: object
    facts: tuple[Fact, ...] = ()
    """The content of the event's text as fields, for programs. It is not part of the digest, which has the text."""

    def plan(self) -> Plan:
        """The value of a ``plan``."""
        if not isinstance(self.value, Profile | StepTrain):
            raise self._other("plan")
        return self.value

    def level(self) -> float:
        """The value of an ``edge``."""
        if not isinstance(self.value, float):
            raise self._other("edge")
        return self.value

    def data(self) -> bytes:
        """The value of a ``frame``."""
        if not isinstance(self.value, bytes):
            raise self._other("frame")
        return self.value

    def _other(self, kind: str) -> TypeError:
        return TypeError(f"a record of kind {self.kind} with the value {self.value!r}: expected a {kind}")


RecordSink: TypeAlias = Callable[[TraceRecord], None]
"""Receives each record as it happens: the `add` of a `Trace`, or another receiver."""


class Trace:
    """The records of a world. ``controllers`` fixes their order in the digest; a controller not named there comes last.

    With ``keep=False`` only the digest and the number of records grow: for runs too long to be kept.
    """

    def __init__(self, controllers: Iterable[str] = (), *, keep: bool = True) -> None:
        self.is_kept = keep
        self.is_recorded = True
        """Whether there is a digest."""
        self._streams: dict[str, _Stream] = {name: _Stream() for name in controllers}
        self._together: Sequence[Sequence[str]] = ()
        self._latest_number = 0
        self.subscribers: list[RecordSink] = []
        """Called with every record."""

    @property
    def controllers(self) -> list[str]:
        return list(self._streams)

    def read_together(self, controllers: Iterable[Sequence[str]]) -> None:
        """Read the records of these controllers, which share a scheduler, in the order in which they came; those of each
        scheduler one after the other, and before those of controllers that are not named."""
        self._together = tuple(controllers)

    def add(self, record: TraceRecord) -> None:
        """Take what happened to a controller after everything taken of it before. `Misuse` where its time goes back.

        ``value`` is immutable; one of a kind that `encode` does not know makes `digest` raise.
        """
        stream = self._streams.get(record.controller)
        if stream is None:
            stream = self._streams[record.controller] = _Stream()
        if record.time < stream.latest:
            raise Misuse(f"{record.controller}: a record of {record.time} ns after one of {stream.latest} ns")
        stream.latest = record.time
        stream.count += 1
        if self.is_kept:
            self._latest_number += 1
            stream.records.append(record)
            stream.numbers.append(self._latest_number)
        elif self.is_recorded:
            stream.hash.update(encode(record))
        for subscriber in self.subscribers:
            subscriber(record)

    def __len__(self) -> int:
        """Number of records so far, kept or not."""
        return sum(stream.count for stream in self._streams.values())

    def __iter__(self) -> Iterator[TraceRecord]:
        """All kept records by time; those of one moment by the order of schedulers, within one as they happened."""
        apart = dict(self._streams)
        groups: list[Iterable[TraceRecord]] = []
        for names in self._together:
            streams = [apart.pop(name) for name in names if name in apart]
            groups.append(_as_they_came(streams) if len(streams) > 1 else streams[0].records if streams else ())
        return merge(*groups, *(stream.records for stream in apart.values()), key=itemgetter(0))

    def of(self, *kinds: str, controller: str | None = None) -> Iterator[TraceRecord]:
        """The records of these kinds, of one controller where it is named, in order. `Misuse` for an unknown kind."""
        for kind in kinds:
            if kind not in KINDS:
                raise Misuse(f"no kind of record {kind!r}: kinds are {', '.join(KINDS)}")
        if controller is None:
            chosen: Iterator[TraceRecord] = iter(self)
        else:
            chosen = iter(self._streams[controller].records if controller in self._streams else ())
        return (record for record in chosen if record.kind in kinds)

    def plans(self, controller: str | None = None) -> Iterator[TraceRecord]:
        return self.of("plan", controller=controller)

    def loads(self, controller: str | None = None) -> Iterator[TraceRecord]:
        return self.of("load", controller=controller)

    def edges(self, controller: str | None = None) -> Iterator[TraceRecord]:
        return self.of("edge", controller=controller)

    def frames(self, controller: str | None = None) -> Iterator[TraceRecord]:
        return self.of("frame", controller=controller)

    def statements(self, controller: str | None = None) -> Iterator[TraceRecord]:
        return self.of("statement", controller=controller)

    def events(self, controller: str | None = None) -> Iterator[TraceRecord]:
        return self.of("event", controller=controller)

    def inputs(self, controller: str | None = None) -> Iterator[TraceRecord]:
        return self.of("input", controller=controller)

    def faults(self, controller: str | None = None) -> Iterator[TraceRecord]:
        return self.of("fault", controller=controller)

    def stop(self) -> None:
        """Keep no records and no digest from now on; only `subscribers` are called."""
        self.is_kept = self.is_recorded = False
        for stream in self._streams.values():
            stream.clear()

    def let_go(self) -> None:
        """Keep only the digest, including that of the records so far."""
        self.is_kept = False
        for stream in self._streams.values():
            stream.let_go()

    def mark(self) -> Mark:
        """The present place, for `rewind`."""
        return Mark(tuple((name, stream.mark()) for name, stream in self._streams.items()))

    def rewind(self, mark: Mark) -> None:
        """Have the past of ``mark``, which was taken of this trace or of one of the same controllers."""
        known = dict(mark.streams)
        for name in known:
            self._streams.setdefault(name, _Stream())
        for name, stream in self._streams.items():
            stream.rewind(known.get(name) or _Stream().mark())
            self._latest_number = max(self._latest_number, *stream.numbers[-1:], 0)

    def digest(self) -> str:
        """Equal for two runs of the same world, on any machine and Python version: 32 hexadecimal digits. A digest of the digests
        of the controllers: their merged order follows from their times. Raises `Misuse` if nothing is recorded."""
        if not self.is_recorded:
            raise Misuse("nothing is recorded of this world: it has no digest")
        whole = blake2b(digest_size=DIGEST_BYTES)
        for name, stream in self._streams.items():
            if stream.count:
                whole.update(_value(name) + stream.digest())
        return whole.hexdigest()


class StreamMark(NamedTuple):
    """The past of one controller: its records, as far as they are kept, and what was hashed of them."""

    count: int
    latest: Nanos
    hash: blake2b
    hashed: int
    records: tuple[TraceRecord, ...]
    numbers: tuple[int, ...]

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle: a hash in progress cannot be saved, but made again from records that were kept."""
        if self.count != len(self.records):
            raise Misuse("a world that keeps no trace cannot be pickled")
        return _mark_of, (self.latest, self.records, self.numbers)


def _mark_of(latest: Nanos, records: tuple[TraceRecord, ...], numbers: tuple[int, ...]) -> StreamMark:
    return StreamMark(len(records), latest, blake2b(digest_size=DIGEST_BYTES), 0, records, numbers)


def _as_they_came(streams: Iterable[_Stream]) -> Iterator[TraceRecord]:
    """The records of several controllers by time, those of one moment in the order in which they came."""
    numbered = (zip(stream.records, stream.numbers, strict=True) for stream in streams)
    return (record for record, _ in merge(*numbered, key=_time_and_number))


def _time_and_number(numbered: tuple[TraceRecord, int]) -> tuple[Nanos, int]:
    return numbered[0].time, numbered[1]


class Mark(NamedTuple):
    """A place in a trace."""

    streams: tuple[tuple[str, StreamMark], ...]


class _Stream:
    """The records of one controller."""

    __slots__ = ("_hashed", "count", "hash", "latest", "numbers", "records")

    def __init__(self) -> None:
        self.records: list[TraceRecord] = []
        self.numbers: list[int] = []
        """Number of each record among those of all controllers."""
        self.count = 0
        self.latest: Nanos = 0
        self.hash = blake2b(digest_size=DIGEST_BYTES)
        self._hashed = 0

    def digest(self) -> bytes:
        """Kept records are hashed on demand: taking them has to be cheap."""
        for record in islice(self.records, self._hashed, None):
            self.hash.update(encode(record))
        self._hashed = len(self.records)
        return self.hash.digest()

    def let_go(self) -> None:
        self.digest()
        self.clear()

    def clear(self) -> None:
        self.records.clear()
        self.numbers.clear()
        self._hashed = 0

    def mark(self) -> StreamMark:
        return StreamMark(self.count, self.latest, self.hash.copy(), self._hashed, tuple(self.records), tuple(self.numbers))

    def rewind(self, mark: StreamMark) -> None:
        self.count, self.latest, hashed, self._hashed, records, numbers = mark
        self.hash, self.records, self.numbers = hashed.copy(), list(records), list(numbers)


# ---------------------------------------------------------------------- canonical bytes

_HEAD = struct.Struct("<qI")
_LENGTH = struct.Struct("<cI")
_FLOAT = struct.Struct("<cd")
_SEGMENT = struct.Struct("<6db")
_ARC = struct.Struct("<6dqb")


def encode(record: TraceRecord) -> bytes:
    """The same bytes for the same record everywhere: floats by their IEEE bytes, integers exactly."""
    time, _, kind, subject, value, _ = record
    body = _names(kind, subject) + (_profile(value) if type(value) is Profile else _value(value))
    return _HEAD.pack(time, len(body)) + body


@lru_cache(4096)
def _names(kind: str, subject: str) -> bytes:
    return _value(kind) + _value(subject)


def _value(value: object) -> bytes:
    if isinstance(value, float):
        return _FLOAT.pack(b"f", value)
    if isinstance(value, StepTrain):
        return _framed(b"t", _profile(value.profile) + _value(tuple(value.divisions)))
    if isinstance(value, str):
        return _framed(b"s", value.encode())
    if isinstance(value, bool) or value is None:
        return b"?" + str(value)[:1].encode()
    if isinstance(value, int):
        return _framed(b"i", str(value).encode())
    if isinstance(value, bytes):
        return _framed(b"b", value)
    if isinstance(value, tuple):
        return _framed(b"l", b"".join([_value(item) for item in value]))
    if isinstance(value, Profile):
        return _profile(value)
    raise Misuse(
        f"{value!r} cannot be in a trace: permitted are numbers, text, bytes, profiles, trains of pulses and tuples of them"
    )


def _framed(tag: bytes, data: bytes) -> bytes:
    return _LENGTH.pack(tag, len(data)) + data


def _profile(profile: Profile) -> bytes:
    data = b"%d %d " % (profile.start, profile.base) + _FLOAT.pack(b"f", profile.final_p)
    for s in profile.segments:
        if type(s) is Segment:  # as `_segment`, without a call for the most frequent
            data += _SEGMENT.pack(s.end_s, s.anchor_s, s.c0, s.c1, s.c2, s.c3, s.direction)
        else:
            data += _arc(s) if isinstance(s, ArcSegment) else _segment(s)
    return _LENGTH.pack(b"p", len(data)) + data


def _segment(s: Segment) -> bytes:
    return _SEGMENT.pack(s.end_s, s.anchor_s, s.c0, s.c1, s.c2, s.c3, s.direction)


def _arc(s: ArcSegment) -> bytes:
    curve = s.curve
    shape = _ARC.pack(s.end_s, curve.centre_p, curve.radius_p, curve.angle_q, curve.turn_q, s.end_p, s.half, s.direction)
    return b"a" + shape + _segment(s.travel)
