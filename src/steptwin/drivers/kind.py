"""The interface between programs and the drivers of a device: one `DriverKind` for each kind of device,
`steptwin.drivers.kinds.DRIVERS`.

The commands of the shell, the search for devices and the studio use nothing else.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Generic, NamedTuple, Protocol, TypeAlias, TypeVar

from steptwin.controller import Nanos
from steptwin.drivers.line import DriverLine
from steptwin.drivers.subject import DevicePart
from steptwin.drivers.tcp import Endpoint
from steptwin.errors import Misuse, Refusal
from steptwin.messages import Message
from steptwin.optionalmethods import OptionalMethods
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
    base: int = 10
    """Base of the numeral of an address: 10 or 16."""
    usual: int | None = None
    """The address on the line if none is given; None: the driver selects nothing, as there is one controller only."""
    may_be_open: bool = False
    """Whether a driver may hold the line without selecting one of its controllers."""
    has_config: bool = False
    """Whether ``config`` names the configuration file of the device."""

    def show(self, number: int) -> str:
        return f"{number:X}" if self.base == 16 else str(number)

    def read(self, text: str) -> int:
        """Raises `ValueError`."""
        return int(text, self.base)

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
    """Rest of the work when an axis has arrived."""
    must_wait: str = ""
    """Why a program has to wait for its end; empty if it need not."""
    stop_note: str = ""
    """Effect that a stop spoils, as the end of a sentence."""


class DeviceDeadManJog(Protocol):
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


class Decoding(ABC):
    """Decoding of the traffic between other programs and devices of a kind, in words."""

    framed_tcp: bool = True
    """Whether ``tcp://`` carries the frames of Modbus TCP, not the bytes of the line."""

    @property
    @abstractmethod
    def protocol(self) -> str:
        """``--language`` of ``steptwin sniff``."""

    @abstractmethod
    def make(self, sink: Callable[[FrameLine], None], variant: str | None, tcp: bool) -> Decoder:
        """A decoder that gives its lines to ``sink``, for a variant (None: the usual one). ``tcp``: the frames are those of
        Modbus TCP. Raises `Misuse`."""


class FoundDevice(NamedTuple):
    number: int
    variant: str | None
    """None if it did not name it."""
    what: str


class DeviceSearch(ABC):
    """Search for devices of a kind on a line. Nothing moves, and no setting is changed."""

    @property
    @abstractmethod
    def bauds(self) -> Sequence[int]:
        """The rates to try, bit/s."""

    @property
    @abstractmethod
    def numbers(self) -> int | None:
        """How many addresses are tried; None: those that a user names."""

    @property
    @abstractmethod
    def title(self) -> str:
        """For a progress bar: ``unit``."""

    @property
    @abstractmethod
    def form(self) -> str:
        """The format of an address there."""

    @property
    @abstractmethod
    def disturbs(self) -> bool:
        """Whether what is sent may disturb devices of other kinds, so that those are searched first."""

    @abstractmethod
    def find(
        self, place: str, baud: int, numbers: Sequence[int], timeout_s: float, progress: Callable[[int], object]
    ) -> Sequence[FoundDevice]:
        """The devices at an address and a rate: those of the numbers, waiting for each until its time-out. ``progress`` is called
        with each number before. Raises `LineFailure`."""

    def leave(self, place: str, baud: int) -> None:
        """Put devices of this kind back into their usual state where none was found."""


FOR_COMMANDS_ONLY = Message("drivers.for-commands-only", "{kind} cannot be connected: its driver is for commands only")


class DriverKind(OptionalMethods, ABC, Generic[D]):
    """A kind of device, and what its drivers offer. Each kind is one object of one class, in its folder.

    A missing member that every kind has is a `TypeError` at import. Methods that only some kinds have raise `Misuse` in the
    others.
    """

    @property
    @abstractmethod
    def name(self) -> str:
        """``,kind=NAME`` behind an address; also the name of its twins."""

    @property
    @abstractmethod
    def title(self) -> str:
        """With its article, for messages: ``a MIC488``."""

    @property
    @abstractmethod
    def axes(self) -> int:
        """Number of axes."""

    @property
    @abstractmethod
    def selection(self) -> AddressSelection: ...

    @property
    @abstractmethod
    def baud(self) -> int: ...

    @property
    @abstractmethod
    def timeout_s(self) -> float: ...

    @property
    @abstractmethod
    def usual(self) -> Sequence[str]:
        """The names of values that are watched if none is given."""

    search: DeviceSearch | None = None
    decoding: Decoding | None = None
    """None: the traffic cannot be put into words."""
    programs: Collection[str] = ()
    """Suffixes of its programs."""
    cannot_send: str = ""
    """Why programs cannot be downloaded, and what else can be done."""

    def lacks(self, what: str) -> Misuse:
        """Refusal of what only other devices have."""
        return Misuse(f"{self.title} has no {what}")

    def check_axis(self, number: int) -> int:
        """Raises `Misuse` for an axis that is not there."""
        if not 1 <= number <= self.axes:
            last = "" if self.axes == 1 else f" to {self.axes}"
            raise Misuse(f"axis {number} is not one of {self.title}: permitted are 1{last}")
        return number

    # ------------------------------------------------------------------ as a subject, in an event loop

    def line(self, place: str | Endpoint, baud: int) -> DriverLine[Any, Any]:
        """A line at an address, or on a serial port that is given. It is not opened."""
        raise Misuse(FOR_COMMANDS_ONLY(kind=self.title))

    async def part(self, address: DeviceAddress, line: DriverLine[Any, Any]) -> DevicePart:
        """The device on a line, which is opened; nothing moves. Raises `SteptwinError`."""
        raise Misuse(FOR_COMMANDS_ONLY(kind=self.title))

    # ------------------------------------------------------------------ on lines of unknown devices

    def clear(self, place: str, baud: int) -> None:
        """End bytes of other protocols on the line, so that devices of this kind read their next command correctly. Kinds to
        which they do no harm do not have it."""

    # ------------------------------------------------------------------ for a thread

    @abstractmethod
    def opened(self, address: DeviceAddress, observe: bool, log: Log | None) -> AbstractContextManager[D]:
        """An open driver. ``observe``: it leaves settings as they are that commands need."""

    @abstractmethod
    def info(self, driver: D, address: DeviceAddress) -> DeviceOverview: ...

    @abstractmethod
    def names(self) -> Sequence[str]:
        """The names of values, for completion."""

    @abstractmethod
    def reading(self, names: Sequence[str]) -> Callable[[D], ReadValues]:
        """A function that reads values by name. Raises `Misuse`, as the function does, for what is no name."""

    @abstractmethod
    def followed(self, names: Sequence[str], variant: str | None) -> Sequence[str] | None:
        """The points of a running twin of a variant that have these names (none: the usual ones); None if a driver has to read
        them."""

    @abstractmethod
    def writing(self, changes: Sequence[str]) -> Callable[[D], ReadValues]:
        """A function that writes NAME=VALUE one after the other, all of them checked before the first is sent, and gives the
        values that can be read again. Raises as `reading`."""

    @abstractmethod
    def stop(self, address: DeviceAddress, log: Log | None, axes: Collection[int], program: bool) -> str | None:
        """Stop axes at once (none: all), and with ``program`` the program. Opens the line itself. Gives a warning, if there is
        one."""

    def enable(self, driver: D, axes: Collection[int], on: bool) -> None:
        """Switch drives of axes (none: all) on or off."""
        raise self.lacks("enable" if on else "disable")

    @abstractmethod
    def move(self, moves: WantedMoves) -> DeviceMotion[D]: ...

    def home(self, texts: Sequence[str]) -> DeviceMotion[D]:
        """``AXIS=VALUE`` as typed. Raises `Misuse`."""
        raise self.lacks("home")

    def seek(self, texts: Sequence[str]) -> DeviceMotion[D]:
        """The same, for a motion until a line has its end level."""
        raise self.lacks("seek")

    def jog(self, driver: D, axis: int, velocity: float, hold_s: float) -> DeviceDeadManJog:
        """A jog of an axis, which lasts for ``hold_s`` after each `DeviceDeadManJog.hold`."""
        raise self.lacks("jog")

    @abstractmethod
    def wait(self, driver: D, axes: Collection[int], timeout_s: float | None) -> Sequence[EndedMotion]:
        """Wait for the end of the motions of axes, for a time at most; None: as computed from the motion."""

    @abstractmethod
    def halt(self, driver: D, axes: Collection[int]) -> None:
        """Stop axes."""

    def terminal(self, address: DeviceAddress, show: Callable[[str], object], log: Log | None) -> DeviceTerminal:
        """A conversation; ``show`` gets what comes without being asked."""
        raise self.lacks("terminal")

    def send(
        self, address: DeviceAddress, file: Path, text: str, progress: Progress, check: Callable[[], object], log: Log | None
    ) -> SentProgram:
        """Download the text of a file; ``check`` is called immediately before something may move. Raises `SteptwinError`."""
        raise self.not_sent(file)

    def not_sent(self, file: Path) -> Refusal:
        """Refusal of a program that cannot be downloaded."""
        return Refusal(f"{file} was not sent: {self.cannot_send or f'{self.title} takes no programs'}")


AnyDriverKind: TypeAlias = DriverKind[Any]
