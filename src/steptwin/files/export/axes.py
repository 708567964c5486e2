"""The views with which the axes of a world are exported."""

from __future__ import annotations

from typing import TYPE_CHECKING

from steptwin.motioncontroller import MotionController
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.kinds.kind import AnyKind
from steptwin.simulation.mechanics.channels import AxisChannel, AxisViews, Mechanics, MovedChannel

if TYPE_CHECKING:
    from steptwin.simulation.components.axis import BuiltAxis
    from steptwin.simulation.world.simulation import Simulation


def axis_views(world: Simulation) -> AxisViews:
    """The views of all axes of the controllers in a world, with the mechanics that they move."""
    views: dict[tuple[str, str], AxisChannel] = {}
    for name, controller in world.controllers.items():
        views |= controller_views(name, world.kind(name), controller)
    moved: dict[str, list[MovedChannel]] = {}
    for element in ELEMENTS.values():
        if element.moved is not None:
            for built in world.objects.built(element).values():
                for axis, channel in element.moved(built):
                    moved.setdefault(axis, []).append(channel)
    for name, fitted in world.axes.items():
        place = fitted.mechanism.controller, str(fitted.mechanism.number)
        views[place] = views[place]._replace(mechanics=_mechanics(fitted)._replace(moved=tuple(moved.get(name, ()))))
    return views


def controller_views(name: str, kind: AnyKind, controller: MotionController) -> dict[tuple[str, str], AxisChannel]:
    """The views of the axes of one controller, for traces in which it is called ``name``."""
    return {(name, axis): view for axis, view in kind.channels(controller).items()}


def _mechanics(fitted: BuiltAxis) -> Mechanics:
    spec, build = fitted.spec, fitted.mechanism.build
    slips = spec.encoder is not None and spec.encoder.slip != 0.0
    scale = build.sign * float(fitted.scale.pulses_per_unit)
    return Mechanics(spec.name, fitted.scale.unit, scale, build.sign * build.zero, build.ideal and not slips)
