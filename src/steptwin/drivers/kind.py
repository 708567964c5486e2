"""What programs need of the drivers of a device: one value for each kind of device, `steptwin.drivers.kinds.DRIVERS`.

The commands of the shell, the search for devices and the studio use nothing else. A field that only some devices have is None in
the others, and a command that needs it is refused with a message.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Generic, NamedTuple, Protocol, TypeAlias, TypeVar

from steptwin.drivers.line import DriverLine
from steptwin.drivers.subject import DevicePart
from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection

D = TypeVar("D")
Log: TypeAlias = Callable[[str], object]
Progress: TypeAlias = Callable[[int, int], object]
"""Called with what is done and the whole."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AddressSelection:
    """How options behind an address of a device select a controller on its line (``,unit=2``), and name its variant. Running
    twins announce both under the same names."""

    option: str
    variant: str
    forms: str
    """The options that only this kind has, for messages: ``unit=N, firmware=1.70``."""
    show: Callable[[int], str] = str
    read: Callable[[str], int] = int
    usual: int | None = None
    """The address on the line if none is given; None: the driver selects nothing, as there is one controller only."""
    may_be_open: bool = False
    """Whether a driver may hold the line without selecting one of its controllers."""
    has_config: bool = False
    """Whether ``config`` names the configuration file of the device."""

    @property
    def options(self) -> frozenset[str]:
        return frozenset({self.option, self.variant} | ({"config"} if self.has_config else set()))


@dataclass(frozen=True, slots=True)
class DeviceAddress:
    """A device address taken apart. ``timeout`` in s.

    ``number``: the address on the line (unit, chip), None if nothing is selected. ``variant``: firmware or type, None:
    determined when opened. ``config``: the configuration file. ``scales``: unit and pulses per unit of each axis, which a running
    twin announces; empty where they are not known.
    """

    place: str
    kind: str
    number: int | None
    baud: int
    timeout: float
    variant: str | None = None
    config: str | None = None
    scales: tuple[tuple[str, float], ...] = ()


class ReadValue(NamedTuple):
    """A value that was read; None if unknown. ``meaning``: of a value that is one of a list, in words."""

    value: Any
    unit: str = ""
    meaning: str = ""


ReadValues: TypeAlias = Mapping[str, ReadValue]


class DeviceOverview(NamedTuple):
    """A device at a glance: as data, and as lines for people around a table."""

    data: Mapping[str, Any]
    head: Sequence[str]
    rows: Sequence[Sequence[object]] = ()
    tail: Sequence[str] = ()


class EndedMotion(NamedTuple):
    """The end of a motion of an axis, which people call ``name``. ``ok``: it ended as intended; ``is_overdue``: it has not
    ended. ``position`` is None if unknown."""

    axis: int
    name: str
    ok: bool
    reason: str
    position: float | None
    unit: str
    after_s: float
    detail: str = ""
    is_overdue: bool = False

    def __str__(self) -> str:
        where = "" if self.position is None else f" at {self.position:g} {self.unit}"
        return f"{self.name}: {self.reason}{where}{f' ({self.detail})' if self.detail else ''}"


class WantedMoves(NamedTuple):
    """Targets of axes, or distances with ``is_by``, in the units of the driver; ``velocity`` is set first."""

    targets: Mapping[int, float]
    is_by: bool
    velocity: float | None


@dataclass(frozen=True, slots=True)
class DeviceMotion(Generic[D]):
    """A motion that can be begun."""

    axes: Sequence[int]
    begin: Callable[[D, set[int], Callable[[], object]], object]
    """Begin it, and put each axis that has begun into the set. The function is called immediately before each motion."""
    end: Callable[[D, EndedMotion], EndedMotion] = lambda driver, ended: ended
    """What remains to be done when an axis has arrived."""
    must_wait: str = ""
    """Why a program has to wait for its end; empty if it need not."""
    stop_note: str = ""
    """What a stop spoils, as the end of a sentence."""


class DeviceHeldJog(Protocol):
    """A jog that has to be held: ``with jog: while ...: jog.hold()``. At the end of the block the axis brakes."""

    def __enter__(self) -> object: ...

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /) -> None: ...

    @property
    def unit(self) -> str:
        """The unit of the axis."""
        ...

    @property
    def ahead_s(self) -> float:
        """How long the axis runs on after a call of `hold` that is the last one, besides its ramp, s."""
        ...

    def hold(self) -> bool:
        """The axis runs on for a short time, after which this returns; False when it has stopped."""
        ...

    def ended(self) -> EndedMotion:
        """After the block: why and where the axis has stopped. Its time is not that of the whole jog."""
        ...


class DeviceTerminal(Protocol):
    """A conversation with a device, line by line."""

    @property
    def greeting(self) -> str: ...

    @property
    def prompt(self) -> str: ...

    @property
    def help(self) -> str: ...

    @property
    def names(self) -> Sequence[str]:
        """Names that can be completed."""
        ...

    def greet(self) -> None:
        """Reach the device, before the first line is typed. Raises `SteptwinError`."""
        ...

    def is_stop(self, line: str) -> bool:
        """Whether a line stops a motion at once."""
        ...

    def answer(self, line: str, *, waits: bool) -> Iterable[str]:
        """Execute a line and return the text to show. ``waits``: until the device has done it. Raises `SteptwinError`."""
        ...

    def close(self) -> None: ...


class SentProgram(NamedTuple):
    """A program that has been downloaded: as data and as a sentence."""

    data: Mapping[str, Any]
    text: str


class Decoder(Protocol):
    """Decodes bytes. ``direction`` is None if both directions share one wire."""

    def feed(self, data: bytes, now: Nanos, direction: FrameDirection | None) -> None: ...
    def deadline(self) -> Nanos | None: ...
    def expire(self, now: Nanos) -> None: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Decoding:
    """How the traffic between other programs and devices of a kind is put into words."""

    protocol: str
    """``--language`` of ``steptwin sniff``."""
    make: Callable[[Callable[[FrameLine], None], str | None, bool], Decoder]
    """A decoder that gives its lines to the function. The text is the variant (None: the usual one), the flag says whether the
    frames are those of Modbus TCP. Raises `Misuse`."""
    framed_tcp: bool = True
    """Whether ``tcp://`` carries the frames of Modbus TCP, not the bytes of the line."""


class FoundDevice(NamedTuple):
    number: int
    variant: str | None
    """None if it did not name it."""
    what: str


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceSearch:
    """How devices of a kind are searched on a line. Nothing moves, and no setting is changed."""

    bauds: Sequence[int]
    """The rates to try, bit/s."""
    numbers: int | None
    """How many addresses are tried; None: those that a user names."""
    title: str
    """For a progress bar: ``unit``."""
    form: str
    """The format of an address there."""
    find: Callable[[str, int, Sequence[int], float, Callable[[int], object]], Sequence[FoundDevice]]
    """The devices at an address and a rate: those of the numbers, waiting so many seconds for each. The function is called with
    each number before. Raises `LineFailure`."""
    disturbs: bool
    """Whether what is sent may disturb devices of other kinds, so that those are searched first."""
    leave: Callable[[str, int], None] = lambda place, baud: None
    """Put devices of this kind back into their usual state where none was found."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriverKind(Generic[D]):
    """A kind of device, and what its drivers offer."""

    name: str
    """``,kind=NAME`` behind an address; also the name of its twins."""
    title: str
    """With its article, for messages: ``a MIC488``."""
    axes: int
    """Number of axes."""
    selection: AddressSelection
    baud: int
    timeout_s: float

    # As a subject, in an event loop.
    line: Callable[[str, int], DriverLine[Any, Any]] | None = None
    """A line at an address, which is not opened; None if the device cannot be a subject."""
    part: Callable[[DeviceAddress, DriverLine[Any, Any]], Awaitable[DevicePart]] | None = None
    """The device on a line, which is opened; nothing moves. Raises `SteptwinError`."""

    # On lines of unknown devices.
    search: DeviceSearch | None = None
    clear: Callable[[str, int], None] | None = None
    """End bytes of other protocols on the line, so that devices of this kind read their next command correctly; None where they
    do no harm."""

    decoding: Decoding | None = None
    """None: the traffic cannot be put into words."""

    # For a thread.
    opened: Callable[[DeviceAddress, bool, Log | None], AbstractContextManager[D]]
    """An open driver. The flag: it only observes, and leaves settings as they are that commands need."""
    info: Callable[[D, DeviceAddress], DeviceOverview]
    names: Callable[[], Sequence[str]]
    """The names of values, for completion."""
    usual: Sequence[str]
    """The names of values that are watched if none is given."""
    reading: Callable[[Sequence[str]], Callable[[D], ReadValues]]
    """A function that reads values by name. Raises `Misuse`, as the function does, for what is no name."""
    followed: Callable[[Sequence[str], str | None], Sequence[str] | None]
    """The points of a running twin of a variant that have these names (none: the usual ones); None if a driver has to read
    them."""
    writing: Callable[[Sequence[str]], Callable[[D], ReadValues]]
    """A function that writes NAME=VALUE one after the other, all of them checked before the first is sent, and gives the values
    that can be read again. Raises as ``reading``."""
    stop: Callable[[DeviceAddress, Log | None, Collection[int], bool], str | None]
    """Stop axes at once (none: all), and with the flag the program. Opens the line itself. Gives a warning, if there is one."""
    enable: Callable[[D, Collection[int], bool], object] | None = None
    """Switch drives of axes (none: all) on or off."""
    move: Callable[[WantedMoves], DeviceMotion[D]]
    home: Callable[[Sequence[str]], DeviceMotion[D]] | None = None
    """``AXIS=VALUE`` as typed. Raises `Misuse`."""
    seek: Callable[[Sequence[str]], DeviceMotion[D]] | None = None
    """The same, for a motion until a line has its end level."""
    jog: Callable[[D, int, float, float], DeviceHeldJog] | None = None
    """A jog of an axis at a velocity, which lasts for so many seconds after each `DeviceHeldJog.hold`."""
    wait: Callable[[D, Collection[int], float | None], Sequence[EndedMotion]]
    """Wait for the end of the motions of axes, so many seconds at most; None: as computed from the motion."""
    halt: Callable[[D, Collection[int]], object]
    """Stop axes."""
    terminal: Callable[[DeviceAddress, Callable[[str], object], Log | None], DeviceTerminal] | None = None
    """A conversation; the function shows what comes without being asked."""
    programs: Collection[str] = ()
    """Suffixes of its programs."""
    send: Callable[[DeviceAddress, Path, str, Progress, Callable[[], object], Log | None], SentProgram] | None = None
    """Download the text of a file; the second function is called immediately before something may move."""
    cannot_send: str = ""
    """Why programs cannot be downloaded, and what else can be done."""

    def check_axis(self, number: int) -> int:
        """Raises `Misuse` for an axis that is not there."""
        if not 1 <= number <= self.axes:
            last = "" if self.axes == 1 else f" to {self.axes}"
            raise Misuse(f"axis {number} is not one of {self.title}: permitted are 1{last}")
        return number


AnyDriverKind: TypeAlias = DriverKind[Any]
