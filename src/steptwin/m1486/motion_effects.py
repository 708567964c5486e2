"""Motion and sequencer: settings, distances, moves and seeks (manual chapters VII.2 and VII.4)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from steptwin.m1486.effects import Effect, Maker, Makers, WrongData

if TYPE_CHECKING:
    from steptwin.m1486.chip import M1486

MAKERS = Makers()


def _setting(name: str) -> Maker:
    def make(chip: M1486, number: int, _place: int, following: int) -> Effect:
        drive = chip.drive

        def run() -> int:
            setattr(drive, name, number)
            return following

        return run

    return make


for _name, _attribute in (
    ("Acceleration", "acceleration"),
    ("Start/stop", "start_stop"),
    ("Profile", "profile_speed"),
    ("Velocity", "velocity"),
    ("Qualification", "qualification"),
    ("Number of characteristic", "characteristic"),
):
    MAKERS.does(_name, computes=_name != "Number of characteristic")(_setting(_attribute))


@MAKERS.does("Microstep", computes=True)
def _microstep(chip: M1486, number: int, _place: int, following: int) -> Effect:
    def run() -> int:
        chip.drive.set_microstep(number)
        return following

    return run


def _distance(direction: int) -> Maker:
    def make(chip: M1486, distance: int, _place: int, following: int) -> Effect:
        drive = chip.drive

        def run() -> int:
            _refuse_off_grid(chip, distance)
            drive.distance_u = direction * distance
            drive.endless = 0
            return following

        return run

    return make


MAKERS.does("Forward", computes=True)(_distance(1))
MAKERS.does("Backward", computes=True)(_distance(-1))


def _refuse_off_grid(chip: M1486, number: int) -> None:
    grid = chip.drive.grid_u
    if number % grid:
        raise WrongData(f"{number} is not a multiple of {grid} minimum microsteps (M{chip.drive.microstep})")


@MAKERS.does("Direction", computes=True)
def _direction(chip: M1486, _number: int, _place: int, following: int) -> Effect:
    def run() -> int:
        chip.drive.reverse()
        return following

    return run


@MAKERS.does("Go absolute", "Home")
def _go(chip: M1486, position: int, _place: int, following: int) -> Effect:
    def run() -> int:
        _refuse_off_grid(chip, position)
        chip.drive.go_to(position, chip.now)
        return following

    return run


def _endless(direction: int) -> Maker:
    def make(chip: M1486, _number: int, _place: int, following: int) -> Effect:
        def run() -> int:
            chip.drive.endless = direction
            return following

        return run

    return make


MAKERS.does("Go positive", computes=True)(_endless(1))
MAKERS.does("Go negative", computes=True)(_endless(-1))


@MAKERS.does("Equal")
def _equal(chip: M1486, position: int, _place: int, following: int) -> Effect:
    def run() -> int:
        _refuse_off_grid(chip, position)
        chip.drive.set_counter(position, chip.now)
        return following

    return run


@MAKERS.does("Clear position counter")
def _clear_position(chip: M1486, _number: int, _place: int, following: int) -> Effect:
    def run() -> int:
        chip.drive.set_counter(0, chip.now)
        return following

    return run


@MAKERS.does("Run")
def _run(chip: M1486, _number: int, place: int, following: int) -> Effect:
    def run() -> int:
        return following if chip.motor.move() else place

    return run


def _seek(direction: int) -> Maker:
    def make(chip: M1486, line: int, place: int, following: int) -> Effect:
        def run() -> int:
            return following if chip.motor.seek(line, direction) else place

        return run

    return make


MAKERS.does("Seek positive")(_seek(1))
MAKERS.does("Seek negative")(_seek(-1))
