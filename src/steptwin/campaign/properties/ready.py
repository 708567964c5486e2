"""Ready properties by name: written out for the axes, collisions and controllers that a world has."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from steptwin.campaign.properties.text import parse_property
from steptwin.errors import Misuse
from steptwin.nearmiss import NearMiss
from steptwin.simulation.components.collision import COLLISION
from steptwin.simulation.world.simulation import Simulation

_NAMED = re.compile(r"\s*([A-Za-z]+(?:-[A-Za-z]+)+)\s*(?:=\s*)?(.*)\Z", re.DOTALL)
_TIME = re.compile(r"(?:within\s+)?(\d+(?:\.\d+)?\s*(?:ns|us|ms|s|min|h))\b\s*(.*)\Z", re.DOTALL)
_LATER = re.compile(r"(?:(.*?)\s+)?within\s+(\d+(?:\.\d+)?\s*(?:ns|us|ms|s|min|h))\s*\Z", re.DOTALL)
USUAL_TIME = "1 s"


@dataclass(frozen=True, slots=True)
class ReadyProperty:
    """``needs``: what follows its name. ``write`` gives its text for a world; without one its text with signals that stand for
    those of any."""

    name: str
    needs: str
    meaning: str
    write: Callable[[str, Simulation | None], str]


def _no_collision(rest: str, world: Simulation | None) -> str:
    _nothing("no-collision", rest)
    if world is None:
        return "never any.count > 0"
    names = world.objects.built(COLLISION)
    if not names:
        raise Misuse("property 'no-collision': this world has no [[collision]]")
    return _all(f"never {name}.count > 0" for name in names)


def _no_lost_step(rest: str, world: Simulation | None) -> str:
    later = _LATER.match(rest)
    noticed, time = (later[1] or "", later[2]) if later else (rest, USUAL_TIME)
    if world is None:
        return f"after any.lost != 0 within {time} ({noticed or 'any.noticed'})"
    if not world.axes:
        raise Misuse("property 'no-lost-step-unnoticed': this world has no [[axis]]")
    texts: list[str] = []
    for name, axis in world.axes.items():
        texts.append(f"after {name}.lost != 0 within {time} ({noticed or f'not {_moving_of(world, *axis.spec.drive)}'})")
        if axis.spec.motor is not None:  # always true, by as much torque as it has left: how near it is to losing steps
            texts.append(f"always ({name}.power == 0 or {name}.reserve >= 0)")
    return _all(texts)


def _moving_of(world: Simulation, controller: str, axis: str) -> str:
    paths = _paths(world, controller)
    return f"{controller}.{axis}.moving" if f"{axis}.moving" in paths else f"{controller}.moving"


def _never_moves(rest: str, world: Simulation | None) -> str:
    condition = _given("never-moves-while", rest, "a condition, such as guard.open")
    return f"never (({condition}) and ({_any_moving(world)}))"


def _stops(rest: str, world: Simulation | None) -> str:
    found = _TIME.match(rest)
    condition = "" if found is None else found[2].strip()
    if found is None or not condition.startswith("after "):
        raise Misuse(f"property 'stops-within': {rest!r}: expected TIME after CONDITION, such as 300 ms after stop.pressed")
    return f"after ({condition.removeprefix('after ')}) at {found[1]} not ({_any_moving(world)})"


def _returns(rest: str, world: Simulation | None) -> str:
    later = _LATER.match(rest)
    condition = _given(
        "returns-to-safe", later[1] or "" if later else rest, "the condition that is safe, such as table.OUT1 == 0"
    )
    return f"eventually {f'within {later[2]} ' if later else ''}(always ({condition}))"


def _any_moving(world: Simulation | None) -> str:
    if world is None:
        return "any.moving"
    return " or ".join(
        f"{name}.{path}" for name in world.controllers for path in _paths(world, name) if path.rpartition(".")[2] == "moving"
    )


def _paths(world: Simulation, controller: str) -> list[str]:
    return [point.path for point in world.kind(controller).datasheet(world.controllers[controller]).points]


def _given(name: str, rest: str, what: str) -> str:
    if not rest.strip():
        raise Misuse(f"property {name!r}: expected {what} after it")
    return rest.strip()


def _nothing(name: str, rest: str) -> None:
    if rest.strip():
        raise Misuse(f"property {name!r}: found {rest!r}, expected nothing after it")


def _all(texts: Iterable[str]) -> str:
    return " and ".join(f"({text})" for text in texts)


READY: Mapping[str, ReadyProperty] = {
    one.name: one
    for one in (
        ReadyProperty("no-collision", "", "no [[collision]] happens", _no_collision),
        ReadyProperty(
            "no-lost-step-unnoticed",
            "[CONDITION] [within TIME]",
            "when an axis has lost a step, CONDITION comes true within TIME, 1 s by default; without it: its drive stops",
            _no_lost_step,
        ),
        ReadyProperty("never-moves-while", "CONDITION", "no axis of a controller moves while CONDITION is true", _never_moves),
        ReadyProperty("stops-within", "TIME after CONDITION", "all axes stand TIME after CONDITION came true", _stops),
        ReadyProperty("returns-to-safe", "CONDITION [within TIME]", "in the end CONDITION is true and stays so", _returns),
    )
}


def _named(text: str) -> tuple[ReadyProperty, str] | None:
    found = _NAMED.match(text)
    if found is None or found[1].lower() in ("and", "or"):
        return None
    name = found[1].lower()
    ready = READY.get(name)
    if ready is None:
        raise Misuse(f"property {text!r}: no ready property {name!r}{NearMiss().hint(name, READY)}; there are {', '.join(READY)}")
    rest = found[2].strip()
    return ready, rest[1:-1].strip() if len(rest) > 1 and rest[0] == rest[-1] == '"' else rest


def check_ready(text: str) -> bool:
    """Whether it is a ready property. Raises `Misuse` where what follows its name is wrong, or for an unknown name."""
    named = _named(text)
    if named is not None:
        parse_property(named[0].write(named[1], None))
    return named is not None


def written_out(text: str, world: Simulation) -> str:
    """The text of a property for a world. Raises `Misuse` as `check_ready`, and for what the world does not have."""
    named = _named(text)
    return text if named is None else named[0].write(named[1], world)
