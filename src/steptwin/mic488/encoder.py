"""The encoder of an axis: its shaft, what turns it, and the counter that registers show.

``motor`` in the methods is the drive's counted position in pulses since power-on; ``shaft`` counts the rotation of the shaft
(after ×4 quadrature) and never jumps, also when the counter is written.
"""

from __future__ import annotations

import enum
from typing import Protocol

from steptwin.controller import Nanos
from steptwin.mic488.encoding import wrapped_dint
from steptwin.state import Stateful


class Coupling(enum.Enum):
    """Motion that turns the encoder's shaft, apart from manual turning."""

    DRIVE = "drive"
    """The drive, without loss."""
    FREE = "free"
    """Nothing: a handwheel."""
    BLOCKED = "blocked"
    """Nothing: the drive is mechanically blocked and its steps are lost."""


class ShaftMotion(Protocol):
    """The position of a shaft that mechanics turn; immutable."""

    def count(self, now: Nanos) -> int:
        """Position in pulses of the drive, in the same frame as the drive's counted position."""
        ...


class Encoder(Stateful):
    """``enc_resol`` counts per ``mot_resol`` pulses of the drive, as configured; unless `gear` changes it, that
    is how the encoder is built.
    """

    FIXED = ("enc_resol", "mot_resol")
    __slots__ = (*FIXED, "_built", "_lost", "_motion", "_standing", "_turned", "_zero", "coupling")

    def __init__(self, enc_resol: int, mot_resol: int, coupling: Coupling) -> None:
        self.enc_resol = enc_resol
        self.mot_resol = mot_resol
        self.coupling = coupling
        self._built = (enc_resol, mot_resol)
        """Counts per pulses; negative counts: it counts backwards."""
        self._turned = 0
        """Counts of manual turning."""
        self._lost = 0
        """Pulses of the drive that did not turn the shaft while it was coupled to something else."""
        self._standing = 0
        """Position of the shaft (pulses) while nothing turns it."""
        self._motion: ShaftMotion | None = None
        self._zero = 0
        """Position of the shaft at which the counter shows 0."""

    def shaft(self, motor: int, now: Nanos) -> int:
        counts, pulses = self._built
        return self._turned + self._driven(motor, now) * counts // pulses

    def _driven(self, motor: int, now: Nanos) -> int:
        """Position of the shaft without manual turning, in pulses."""
        if self._motion is not None:
            return self._motion.count(now)
        return motor - self._lost if self.coupling is Coupling.DRIVE else self._standing

    @property
    def agrees(self) -> bool:
        """Whether the counts always follow the drive."""
        counts, pulses = self._built
        as_told = counts * self.mot_resol == pulses * self.enc_resol
        return self.coupling is Coupling.DRIVE and self._motion is None and as_told

    @property
    def turned_by(self) -> Coupling | None:
        """The coupling of the shaft; None: mechanics turn it."""
        return self.coupling if self._motion is None else None

    def counter(self, shaft: int) -> int:
        """The counter register, a DINT that wraps."""
        return wrapped_dint(shaft - self._zero)

    def set_counter(self, value: int, shaft: int) -> None:
        """Write the register: the shaft stays, the number changes."""
        self._zero = shaft - value

    def turn(self, counts: int) -> None:
        """Turn the shaft by hand (or let it slip) by ``counts``."""
        self._turned += counts

    def couple(self, coupling: Coupling, motor: int, now: Nanos) -> None:
        """Select what turns the shaft from ``now`` on; pulses of the drive while it is not coupled are lost."""
        if coupling is not self.coupling or self._motion is not None:
            at = self._driven(motor, now)
            self._motion = None
            if coupling is Coupling.DRIVE:
                self._lost = motor - at
            else:
                self._standing = at
            self.coupling = coupling

    def follow(self, motion: ShaftMotion | None) -> None:
        """Let mechanics turn the shaft (play, a stop, lost steps, another axis); None: the drive, without lost pulses."""
        self._motion = motion
        self._lost = 0
        self.coupling = Coupling.DRIVE

    def gear(self, counts: int, pulses: int, motor: int, now: Nanos) -> None:
        """Set ``counts`` (negative: backwards; not 0) per ``pulses`` (> 0) of the drive, instead of the configured ones."""
        before = self.shaft(motor, now)
        self._built = (counts, pulses)
        self._turned += before - self.shaft(motor, now)

    def pulses(self, counts: float) -> float:
        """Drive pulses that correspond to ``counts``, as configured."""
        return counts * self.mot_resol / self.enc_resol

    def counts(self, pulses: float) -> float:
        """Encoder counts that correspond to ``pulses``, as configured."""
        return pulses * self.enc_resol / self.mot_resol
