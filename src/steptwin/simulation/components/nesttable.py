"""The table of a nest: places for workpieces in a grid, such as a fixture, a magazine or a pallet, on anything that moves."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import floor
from typing import Any

from steptwin.errors import Misuse
from steptwin.simulation.components.bodytable import SHAPES, color_value
from steptwin.simulation.components.logic import Joint, TerminalComponentSpec
from steptwin.simulation.components.mount import MountSpec, to_nm
from steptwin.simulation.components.workpieces import Lie, Rest, size_of_workpiece, workpiece_of
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.space.bodies import Body, Box
from steptwin.simulation.space.frames import TURN_Q, Frame
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import number, permitting, whole, word

_COUNT = whole(1, 1000)
_LENGTH = number(0.001, 100_000.0)


@permitting("[along x, along y], whole numbers from 1")
def _grid(value: Any) -> tuple[int, int]:
    if not isinstance(value, list) or len(value) != 2:
        raise Misuse(f"{value!r}: expected [along x, along y]")
    x, y = map(_COUNT, value)
    return x, y


@permitting("[along x, along y] in mm, from 0.001")
def _lengths(value: Any) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise Misuse(f"{value!r}: expected [along x, along y] in mm")
    x, y = map(_LENGTH, value)
    return x, y


@table("[[nest]]")
class NestSpec(TerminalComponentSpec, MountSpec):
    """Its origin is the middle of the bottom of its first cell; further ones follow along x, then along y."""

    cells: tuple[int, int] = key(_grid, "[along x, along y]: its cells", default=(1, 1))
    pitch: tuple[float, float] = key(_lengths, "[along x, along y] mm from one cell to the next", default=(50.0, 50.0))
    cell: tuple[float, float] | None = key(_lengths, "[along x, along y] mm of a cell; default its pitch", default=None)
    snap: float = key(number(0.0, 1000.0), "mm from the middle of a cell within which it aligns a workpiece", default=5.0)
    snap_angle: float = key(number(0.0, 45.0), "degrees within which it does", default=10.0)
    filled: int = key(
        whole(0, 10_000), "workpieces in it when the world begins, cell by cell and layer by layer", default=0, needs="workpiece"
    )
    workpiece: tuple[float, ...] | None = key(size_of_workpiece, "size of these workpieces", default=None)
    workpiece_shape: str | None = key(
        word(*SHAPES),
        "what each of them looks like within its size; default a box, or a cylinder",
        default=None,
        needs="workpiece",
    )
    workpiece_color: str | None = key(color_value, "of its picture: #RRGGBB", default=None, needs="workpiece")
    mass: float = key(number(0.0), "kg of each of them", default=0.0, needs="workpiece")

    @property
    def holds_workpieces(self) -> bool:
        return True

    @property
    def is_mounted(self) -> bool:
        """Always: it is nowhere else."""
        return True

    @property
    def terminals(self) -> Terminals:
        return Terminals()

    @property
    def joints(self) -> Iterable[Joint]:
        return ()

    def bottom(self, frame: Frame) -> Body:
        """The face that workpieces lie on."""
        (nx, ny), (px, py), (cx, cy) = self.cells, self.pitch, self.cell or self.pitch
        way = (nx - 1) * to_nm(px), (ny - 1) * to_nm(py)
        half = (way[0] + to_nm(cx)) // 2, (way[1] + to_nm(cy)) // 2
        return Body(self.name, frame, Box((half[0], half[1], 0)), (way[0] // 2, way[1] // 2, 0))

    def aligned(self, lie: Lie) -> Lie | None:
        """Where a workpiece is that is put at a place of its bottom; None where it lies crooked."""
        x, y, _ = lie.at
        (nx, ny), pitch = self.cells, (to_nm(self.pitch[0]), to_nm(self.pitch[1]))
        i, j = (min(max(round(at / step), 0), most - 1) for at, step, most in zip((x, y), pitch, (nx, ny), strict=True))
        return self.snapped(lie, (i * pitch[0], j * pitch[1]))

    def snapped(self, lie: Lie, middle: tuple[int, int]) -> Lie | None:
        """Where a workpiece is that is put near a middle; None where it is too far from there, or turned."""
        (x, y, z), yaw_q = lie
        most, straight = to_nm(self.snap), floor(yaw_q + 0.5)
        if max(abs(x - middle[0]), abs(y - middle[1])) > most or abs(yaw_q - straight) * 90.0 > self.snap_angle:
            return None
        return Lie((*middle, z), float(straight % TURN_Q))

    @property
    def middles(self) -> list[tuple[int, int]]:
        """Middles of its cells, nm from its origin."""
        (nx, ny), (px, py) = self.cells, map(to_nm, self.pitch)
        return [(n % nx * px, n // nx * py) for n in range(nx * ny)]

    def workpieces(self) -> Iterator[Rest]:
        """Those that are in it when the world begins."""
        middles, size = self.middles, self.workpiece
        for n in range(0 if size is None else self.filled):
            layer, cell = divmod(n, len(middles))
            its = workpiece_of(f"{self.name}.{n + 1}", size or (), self.mass)
            if layer:
                yield Rest(its, f"{self.name}.{n + 1 - len(middles)}", Lie((0, 0, its.height)))
            else:
                yield Rest(its, self.name, Lie((*middles[cell], 0)))
