"""Motion and sequencer: settings, distances, moves and seeks (manual chapters VII.2 and VII.4)."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.controller import Nanos
from steptwin.m1486.drive import ChipDrive
from steptwin.m1486.effects import CommandHost, Effect, Maker, Makers, WrongData
from steptwin.messages import Message

MAKERS = Makers()


def _setting(change: Callable[[ChipDrive, int], None]) -> Maker:
    def make(chip: CommandHost, number: int, _place: int, following: int) -> Effect:
        drive = chip.drive

        def run(now: Nanos) -> int:
            change(drive, number)
            return following

        return run

    return make


MAKERS.does("Acceleration", computes=True)(_setting(ChipDrive.set_acceleration))
MAKERS.does("Start/stop", computes=True)(_setting(ChipDrive.set_start_stop))
MAKERS.does("Profile", computes=True)(_setting(ChipDrive.set_profile_speed))
MAKERS.does("Velocity", computes=True)(_setting(ChipDrive.set_velocity))
MAKERS.does("Qualification", computes=True)(_setting(ChipDrive.set_qualification))
MAKERS.does("Microstep", computes=True)(_setting(ChipDrive.set_microstep))
MAKERS.does("Number of characteristic")(_setting(ChipDrive.set_characteristic))


def _distance(direction: int) -> Maker:
    def make(chip: CommandHost, distance: int, _place: int, following: int) -> Effect:
        drive = chip.drive

        def run(now: Nanos) -> int:
            _refuse_off_grid(chip, distance)
            drive.distance_u = direction * distance
            drive.endless = 0
            return following

        return run

    return make


MAKERS.does("Forward", computes=True)(_distance(1))
MAKERS.does("Backward", computes=True)(_distance(-1))


NUMBER_OFF_THE_GRID = Message(
    "m1486.number-off-the-grid", "{number} is not a multiple of {grid} minimum microsteps (M{microstep})"
)


def _refuse_off_grid(chip: CommandHost, number: int) -> None:
    grid = chip.drive.grid_u
    if number % grid:
        raise WrongData(NUMBER_OFF_THE_GRID(number=number, grid=grid, microstep=chip.drive.microstep))


@MAKERS.does("Direction", computes=True)
def _direction(chip: CommandHost, _number: int, _place: int, following: int) -> Effect:
    def run(now: Nanos) -> int:
        chip.drive.reverse()
        return following

    return run


@MAKERS.does("Go absolute", "Home")
def _go(chip: CommandHost, position: int, _place: int, following: int) -> Effect:
    def run(now: Nanos) -> int:
        _refuse_off_grid(chip, position)
        chip.drive.go_to(position, now)
        return following

    return run


def _endless(direction: int) -> Maker:
    def make(chip: CommandHost, _number: int, _place: int, following: int) -> Effect:
        def run(now: Nanos) -> int:
            chip.drive.endless = direction
            return following

        return run

    return make


MAKERS.does("Go positive", computes=True)(_endless(1))
MAKERS.does("Go negative", computes=True)(_endless(-1))


@MAKERS.does("Equal")
def _equal(chip: CommandHost, position: int, _place: int, following: int) -> Effect:
    def run(now: Nanos) -> int:
        _refuse_off_grid(chip, position)
        chip.drive.set_counter(position, now)
        return following

    return run


@MAKERS.does("Clear position counter")
def _clear_position(chip: CommandHost, _number: int, _place: int, following: int) -> Effect:
    def run(now: Nanos) -> int:
        chip.drive.set_counter(0, now)
        return following

    return run


@MAKERS.does("Run")
def _run(chip: CommandHost, _number: int, place: int, following: int) -> Effect:
    def run(now: Nanos) -> int:
        return following if chip.motor.move(now) else place

    return run


def _seek(direction: int) -> Maker:
    def make(chip: CommandHost, line: int, place: int, following: int) -> Effect:
        def run(now: Nanos) -> int:
            return following if chip.motor.seek(line, direction, now) else place

        return run

    return make


MAKERS.does("Seek positive")(_seek(1))
MAKERS.does("Seek negative")(_seek(-1))
