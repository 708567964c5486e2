"""The machine in space, as a viewer draws it: frames that carry each other, and what is on them. Lengths in mm, z is up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, TypeAlias

Point: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class JointDescription:
    """A motion of a frame, along an axis of what carries it, or about one."""

    signal: Annotated[str, "Signal of its position: it is at the origin of its frame while that is 0"]
    along: Annotated[str, "Direction: +x, -z ..."]
    turns: bool
    per_unit: Annotated[float, "For a unit of the signal [mm, degrees]"]


@dataclass(frozen=True, slots=True)
class FrameDescription:
    """The frame of an element. What is on it is moved by its joints, the first of which is outermost."""

    name: str
    kind: Annotated[str, "The table of the element: axis, cylinder, conveyor ..."]
    on: Annotated[str | None, "The element that carries it; none: the floor"]
    at: Annotated[Point, "Its origin there, while its joints are at 0 [mm]"]
    along: Annotated[str | None, "Direction of an element that moves workpieces, not what is on it"]
    joints: tuple[JointDescription, ...]
    line: Annotated[int, "Where its table begins in the description"]
    file: Annotated[str | None, "Of that line; none: the description itself"]


@dataclass(frozen=True, slots=True)
class BodyDescription:
    """A box or an upright cylinder that stands on the origin of the frame of its name, with the middle of its lower face."""

    name: str
    size: Annotated[Point | None, "Of a box, along x, y and z [mm]"]
    diameter: float | None
    height: float | None
    color: Annotated[str | None, "#RRGGBB"]
    when: Annotated[str | None, "The condition under which it is there"]
    lit: Annotated[str | None, "The condition under which it shines"]
    model: Annotated[str | None, "A file that is seen in its place: .stl in mm with z up, .glb in m with y up"]
    shape: Annotated[str | None, "What it looks like within its size: bottle, wheel ..."] = None
    draws: Annotated[str | None, "The condition under which it leaves a line, at its origin"] = None
    draws_on: Annotated[str | None, "The element with which the line goes on; none: the floor"] = None
    line_to: Annotated[str | None, "An element to which a line goes from its middle"] = None


@dataclass(frozen=True, slots=True)
class OriginDescription:
    """Look of the workpieces that come from an element; their names begin with its name and a point."""

    name: str
    shape: Annotated[str | None, "Within their size: bottle, wheel ..."]
    color: Annotated[str | None, "#RRGGBB"]


@dataclass(frozen=True, slots=True)
class CupDescription:
    """A suction cup that points down, with the middle of its lip at the origin of the frame of its name."""

    name: str
    diameter: Annotated[float, "Of its lip [mm]"]


@dataclass(frozen=True, slots=True)
class NestDescription:
    """Cells for workpieces, the first of which has the middle of its bottom at the origin of the frame of its name."""

    name: str
    cells: Annotated[tuple[int, int], "Along x and along y"]
    pitch: Annotated[tuple[float, float], "From one to the next, along x and along y [mm]"]
    cell: Annotated[tuple[float, float], "Size of one, along x and along y [mm]"]


@dataclass(frozen=True, slots=True)
class BeamDescription:
    """A line of light from the origin of the frame of its name along the direction of that, or several beside each other."""

    name: str
    length: Annotated[float, "To the receiver [mm]"]
    count: int
    pitch: Annotated[float, "From one line to the next [mm]"]
    across: Annotated[str, "Direction from one line to the next: +x, -z ..."]


@dataclass(frozen=True, slots=True)
class MoveState:
    """A signal by whose changes something goes on, besides what carries it."""

    signal: str
    along: Annotated[str, "Direction in the frame of the element: +x, -z ..."]
    per_unit: Annotated[float, "For a unit of the signal [mm]"]
    at: Annotated[float, "The value of the signal while it is where its state says"]


@dataclass(frozen=True, slots=True)
class WorkpieceState:
    """A workpiece, and where the middle of its lower face is in the frame of an element."""

    name: str
    size: Annotated[Point | None, "Of a box: length, width and height [mm]"]
    diameter: Annotated[float | None, "Of an upright cylinder [mm]"]
    height: float
    on: Annotated[str | None, "The element that carries it, perhaps through other workpieces; none: the floor"]
    at: Annotated[Point, "In the frame of that element, once all its joints have moved [mm]"]
    yaw: Annotated[float, "Turn about z [degrees]"]
    moves: Annotated[tuple[MoveState, ...], "By which it goes on from there: its conveyor, and what pushes it across that"]


@dataclass(frozen=True, slots=True)
class SceneDescription:
    """All elements that have a place in space."""

    frames: tuple[FrameDescription, ...] = ()
    bodies: tuple[BodyDescription, ...] = ()
    cups: tuple[CupDescription, ...] = ()
    nests: tuple[NestDescription, ...] = ()
    beams: tuple[BeamDescription, ...] = ()
    origins: tuple[OriginDescription, ...] = ()


NO_SCENE = SceneDescription()
