"""Scripts are evaluated only when something has changed on which their conditions depend. The result is that of evaluating all of
them at every event, in random worlds of machines and elements that share a scheduler."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random
from unittest import mock

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.scheduler.scheduler import Scheduler

SLICES_S = (0.31, 0.0007, 0.52, 0.9)
NUMBERS = (0, 1, 2, 4, 10, 45, 120, 3000)
PROGRAM = b"M1 = ON\nA:\nVABS M1 60\nDELAY 0.11\nOUT2 = ON\nSet R3 = R3 + 1\nPABS M1 7\nWAITPOS\nOUT2 = OFF\nDELAY 0.07\nJUMP A\n"
MIC488 = """
[[mic488]]
name = "{name}"
{more}
[mic488.M1]
acc = 2000.0
dec = 2000.0
vel = 300.0
[[axis]]
name = "{name}-x"
drive = "{name}.M1"
backlash = 2.0
travel = [-90.0, 400.0]
[[axis.switch]]
above = 50.0
to = "{name}.IN3"
bounce = "2 ms"
[[button]]
name = "{name}-b"
to = "{name}.IN9"
bounce = "3 ms"
"""
M1486 = """
[[m1486]]
name = "{name}"
line = "chips"
address = {address}
[[axis]]
name = "{name}-turret"
drive = "{name}.M1"
kind = "rotary"
[[shaft]]
name = "{name}-cams"
axis = "{name}-turret"
ratio = 0.1
"""
ELEMENTS = (
    ('[[gate]]\nname = "{name}"\nkind = "xor"\ninputs = ["{one}", "{other}"]', ("out",)),
    ('[[gate]]\nname = "{name}"\nkind = "nor"\ninputs = ["{one}", "{other}"]', ("out",)),
    ('[[latch]]\nname = "{name}"\nset = "{one}"\nreset = "{other}"', ("out",)),
    ('[[timer]]\nname = "{name}"\ninput = "{one}"\nkind = "on-delay"\ntime = "40 ms"', ("out",)),
    ('[[counter]]\nname = "{name}"\nup = "{one}"\ndown = "{other}"\npreset = 2', ("out",)),
    ('[[relay]]\nname = "{name}"\ncoil = "{one}"\npull_in = "7 ms"', ("no", "nc")),
    ('[[cylinder]]\nname = "{name}"\nextend = "{one}"\nextend_time = "90 ms"', ("extended", "retracted")),
    (
        (
            '[[conveyor]]\nname = "{name}"\nlength = 200.0\nspeed = 400.0\nrun = "{one}"\nfeed_every = "170 ms"\n'
            '[[conveyor.sensor]]\nat = 90.0\nto = "{target}"\nbounce = "2 ms"'
        ),
        (),
    ),
    ('[[vacuum]]\nname = "{name}"\nejector = "{one}"\npick = "{other}"\nbuild_up = "40 ms"', ("held",)),
    ('[[collision]]\nname = "{name}"\nwhen = "m0-x.position > 30 and {one}"', ("hit",)),
)
TRANSDUCER = """
[[transducer]]
name = "gap"
of = "m0-x.position"
to = "m0.AIN1"
points = [[-50, 1.0], [302, 9.0]]
"""
FAULTS = (
    "kind = 'stall', machine = 'm0', axis = 1, for_s = 0.2, at_s = 0.4",
    "kind = 'lost-steps', machine = 'm0', axis = 1, pulses = 30, at_s = 0.5",
    "kind = 'supply-drop', machine = 'm0', for_s = 0.1, at_s = 0.6",
    "kind = 'stuck', machine = 'm0', pin = 'IN3', value = 1",
    "kind = 'bounce', machine = 'm0', pin = 'IN9'",
)
OF_ELEMENTS = {
    "relay": "kind = 'stuck-output', output = 'no', level = 1",
    "cylinder": "kind = 'jam'",
    "conveyor": "kind = 'belt-stop'",
    "vacuum": "kind = 'leak'",
    "collision": "kind = 'stuck-output', output = 'hit', level = 1",
}
"""Others have the output OUT, which may be stuck."""


class Layout:
    """A random world without scripts. Its controllers are connected by wires."""

    def __init__(self, random: Random) -> None:
        self.random = random
        self.mics = [f"m{n}" for n in range(random.randint(1, 3))]
        self.chips = [f"d{n}" for n in range(random.randint(0, 2))]
        self.faults = list(FAULTS)
        self.outputs = [f"{name}.OUT{n}" for name in self.mics for n in (1, 2, 3)]
        self.inputs = [f"{name}.IN{n}" for name in self.mics for n in (4, 5, 6, 7, 8)]
        self.text = "".join(self._controllers()) + "".join(self._elements()) + "".join(self._wires()) + self._transducer()

    def _controllers(self) -> Iterator[str]:
        if on_line := self.random.random() < 0.5:
            yield '[[line]]\nname = "bus"\ntiming = "real"\n'
        if self.chips:
            yield '[[line]]\nname = "chips"\nkind = "m1486"\ntiming = "real"\n'
        for n, name in enumerate(self.mics):
            program = 'program = "p.prg"\nstart = true\n' if self.random.random() < 0.5 else ""
            yield MIC488.format(name=name, more=program + (f'line = "bus"\nunit = {n + 1}\n' if on_line else ""))
        yield from (M1486.format(name=name, address=n) for n, name in enumerate(self.chips))

    def _elements(self) -> Iterator[str]:
        for n in range(self.random.randint(1, 7)):
            text, outputs = self.random.choice(ELEMENTS)
            name = f"e{n}"
            one, other = self.random.choice(self.outputs), self.random.choice(self.outputs)
            target = self._input() if "{target}" in text else ""
            yield text.format(name=name, one=one, other=other, target=target) + "\n"
            kind = text[2 : text.index("]]")]
            fault = OF_ELEMENTS.get(kind, "kind = 'stuck-output', level = 1")
            self.faults.append(f"{fault}, element = '{name}'")
            self.outputs += [f"{name}.{output}" for output in outputs]

    def _input(self) -> str:
        return self.inputs.pop(self.random.randrange(len(self.inputs)))

    def _wires(self) -> Iterator[str]:
        for first, second in zip(self.mics, self.mics[1:], strict=False):
            yield f'[[wire]]\nfrom = "{first}.OUT1"\nto = "{second}.IN1"\n'
        for n, chip in enumerate(self.chips):
            yield f'[[wire]]\nfrom = "m0.OUT{n + 1}"\nto = "{chip}.B1"\n'
        for output in self.random.sample(self.outputs, min(4, len(self.outputs))):
            delay = self.random.choice(("", 'delay = "3 ms"\n', "inverted = true\n"))
            if len(self.inputs) > 1:
                yield f'[[wire]]\nfrom = "{output}"\nto = "{self._input()}"\n{delay}'

    def _transducer(self) -> str:
        return TRANSDUCER if self.random.random() < 0.5 else ""

    # ------------------------------------------------------------------ scripts

    def signals(self) -> list[str]:
        """What conditions can use; terminals, pins and what moves more often than other points."""
        world = World.from_toml(self.text, {"p.prg": PROGRAM})
        parts = world.objects
        found = ["idle"]
        for name, controller in parts.controllers.items():
            points = [f"{name}.{point.path}" for point in parts.kind_of[name].datasheet(controller).points]
            found += self.random.sample(points, min(len(points), 20))
            found += [f"{name}.{pin}" for pin in controller.pins()]
            found += [path for path in points if path.endswith((".position", ".velocity", ".status", ".moving"))] * 3
        for name in parts.element_names:
            found += [f"{name}.{signal}" for signal in parts.element_signals(name) or {}] * 5
        return [name for name in found if is_usable(world, name)]

    def scripts(self, signals: list[str]) -> Iterator[str]:
        for n in range(self.random.randint(3, 14)):
            condition = self._condition(signals)
            if self.random.random() < 0.5:
                steps = [f'{{ note = "v{n}" }}', self._action()]
                yield f'[[event]]\nname = "v{n}"\nwhen = "{condition}"\nsteps = [{", ".join(steps)}]\n'
            else:
                within = self.random.choice(("20 ms", "150 ms", "1 s"))
                steps = [f'{{ until = "{condition}", within = "{within}" }}', f'{{ note = "s{n}" }}', self._action()]
                yield f'[[script]]\nname = "s{n}"\nrepeat = 20\nsteps = [{", ".join(steps)}]\n'
        for n, name in enumerate(self.mics):
            steps = [f'{{ write = {{ "{name}.M1_EN" = 1, "{name}.M1_POS_ABS" = {self.random.choice((40, 90, -20))} }} }}']
            steps += [self._action(), '{ wait = "130 ms" }', self._action(), '{ wait = "70 ms" }']
            yield f'[[script]]\nname = "a{n}"\nat = "{17 * n} ms"\nrepeat = 8\nsteps = [{", ".join(steps)}]\n'
        for chip in range(len(self.chips)):
            yield f'[[script]]\nname = "c{chip}"\nsteps = [{{ send = "chips", text = \'x{chip}\\rv2000\\rf1280\\rr\\r\' }}]\n'

    def _condition(self, signals: list[str]) -> str:
        one = self._comparison(signals)
        if self.random.random() < 0.5:
            return one
        return f"{one} {self.random.choice(('and', 'or', 'and not'))} {self._comparison(signals)}"

    def _comparison(self, signals: list[str]) -> str:
        signal = self.random.choice(signals)
        shape = self.random.random()
        if shape < 0.4:
            return signal
        if shape < 0.9:
            return f"{signal} {self.random.choice(('<', '>', '==', '>='))} {self.random.choice(NUMBERS)}"
        return f"{signal} > {self.random.choice(signals)}"

    def _action(self) -> str:
        mic, number = self.random.choice(self.mics), self.random.randint(1, 3)
        actions = [
            f'{{ write = {{ "{mic}.OUT{number}" = {self.random.randint(0, 1)} }} }}',
            f'{{ write = {{ "{mic}.USER_REGISTER[{number}]" = {self.random.randint(0, 5)} }} }}',
            f'{{ write = {{ "{mic}.M1_POS_ABS" = {self.random.choice((10, 60, 130))} }} }}',
            f'{{ press = "{mic}-b", for = "15 ms" }}',
            f'{{ set = {{ "{mic}.IN2" = {self.random.randint(0, 1)} }} }}',
            f"{{ fault = {{ {self.random.choice(self.faults)} }} }}",
        ]
        return self.random.choice(actions)


def is_usable(world: World, name: str) -> bool:
    try:
        world.condition(name)
    except Misuse:
        return False
    return True


def history(text: str) -> list[object]:
    """What happens in a world, up to an error: of a fault that does not fit, or of scripts that loop."""
    found: list[object] = []
    try:
        world = World.from_toml(text, {"p.prg": PROGRAM})
        for seconds in SLICES_S:
            world.run(for_=seconds)
            waits = [(script.name, script.waiting) for script in world.scripts]
            found.append((world.now, world.trace.digest(), waits, world.failures.state(), world.overdue.state()))
    except Exception as error:  # noqa: BLE001  # both have to fail alike
        found.append((type(error), str(error)))
    return found


@settings(deadline=None, max_examples=12, suppress_health_check=list(HealthCheck))
@given(st.randoms(use_true_random=False))
def test_to_evaluate_everything_at_every_event_changes_nothing(random: Random) -> None:
    layout = Layout(random)
    text = layout.text + "".join(layout.scripts(layout.signals()))
    usual = history(text)
    with mock.patch.object(Scheduler, "take_changed", lambda scheduler: set(scheduler._sources)):
        assert history(text) == usual
