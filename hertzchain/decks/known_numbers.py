"""The numbers of each granule that a deck knows, and its check of what LAMMPS has at the start.

All contacts are pressed in turn by known overlaps, damped ones at known rates too, and the net
force on each granule is compared with the true one: this finds mistakes that move no peak by much.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.decks.layout import KnownAnswer
from hertzchain.engines.external.terms import wall_position, weighty_density
from hertzchain.engines.lammps.dialect import NO_STEP
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.scene.chain import granule_mass
from hertzchain.scene.scene import Scene

_PRESSED_MORE = 8.0
"""Largest over smallest force of the contacts under which the law is checked (chosen)."""

_DAMPERS = ((0.5, -0.5), (0.5, -0.5), (-2.0, -2.0))
"""Damping force over the elastic force of contacts pressed more and pressed less, in each test of
damped contacts (chosen). In the last test dampers would pull, which tests their limit.
"""

_FASTEST = 1e6
"""Largest rate of an overlap in a test, in natural units (chosen); with weak dampers the ratios
above are then smaller.
"""

_OFF = ("pressed", "pressed_less", "pulled")
"""Variables of the largest relative error of net forces in each test."""


@dataclass(frozen=True, eq=False)
class _Test:
    """Places, velocities and net forces of all granules in a test: [m], [m/s], [N].

    Shape (granules,) each.
    """

    position: FloatArray
    velocity: FloatArray
    net_force: FloatArray


class KnownNumbers:
    """Known numbers of each granule, in the columns ``f_known[1]`` and so on."""

    def __init__(self, scene: Scene, known: KnownAnswer) -> None:
        self._scene, each = scene, scene.granules
        granules = scene.bodies
        reach = np.append(each.radius[:-1] + each.radius[1:], 0.0)
        if scene.wall is not None:
            reach[-1] = each.radius[-1] - wall_position(scene)
        self._force = _test_force(scene)
        self._tests = _tests(scene, self._force)
        self._columns = {
            "reach": reach,
            "stiffness": np.append(each.stiffness, 0.0)[:granules],
            "mass": np.asarray(granule_mass(each.radius, weighty_density(each))),
            "start": each.position,
        }
        for number, test in enumerate(self._tests, start=1):
            self._columns[f"place{number}"] = test.position
            self._columns[f"net{number}"] = test.net_force
            if each.damping is not None:
                self._columns[f"speed{number}"] = test.velocity
        if each.damping is not None:
            self._columns["damping"] = np.append(each.damping, 0.0)[:granules]
        # Digits that are the same on every machine.
        true = [float(f"{x:.12g}") for x in np.where(known.judged, known.force_ratio, 0.0)]
        allowed = [float(f"{x:.3g}") for x in known.allowed]
        self._columns["true"] = np.append(true, 0.0)[:granules]
        self._columns["allowed"] = np.append(allowed, 1.0)[:granules]

    def name(self, column: str) -> str:
        """Return the name of a column in formulas."""
        return f"f_known[{list(self._columns).index(column) + 1}]"

    @property
    def overlap(self) -> str:
        """LAMMPS formula of the overlap between a granule and the next one, or the wall [m].

        The place of the next granule is 0 for the last granule.
        """
        overlap = f"{self.name('reach')}+x-c_ahead"
        is_last = f"(id<{self._scene.bodies})"
        return overlap if self._scene.wall is not None else f"{is_last}*({overlap})"

    @property
    def force(self) -> str:
        """LAMMPS formula of the force of a contact [N], from ``touching`` and ``rate``."""
        contact, elastic = self._scene.contact, f"{self.name('stiffness')}*v_touching^1.5"
        if contact is None:
            return elastic
        power = {0.0: "(v_touching>0)", 0.25: "v_touching^0.25", 0.5: "sqrt(v_touching)"}
        return f"{elastic}+{self.name('damping')}*{power[contact.exponent]}*v_rate"

    @property
    def found(self) -> str:
        """What the check of this LAMMPS has found, for a line of the deck."""
        return ", ".join(f"$(v_{name}:%.1e)" for name in (*self._off, "heavier", "misplaced"))

    @property
    def _off(self) -> tuple[str, ...]:
        return _OFF[: len(self._tests)]

    def commands(self) -> list[str]:
        """Commands that compare forces, masses and places in this LAMMPS with the known ones.

        They set the variable ``law``.
        """
        scene, force = self._scene, self._force
        length = float(np.max(np.abs([test.position for test in self._tests])))
        shallowest = (force / _PRESSED_MORE / float(np.max(scene.granules.stiffness))) ** (2 / 3)
        # Forces on a piston move nothing, and LAMMPS computes another weight for it.
        all_but_piston = "" if scene.piston is None else "(id>1)*"
        differences = {
            "misplaced": f"abs(x-{self.name('start')})/{shallowest!r}",
            "heavier": f"abs(mass/{self.name('mass')}-1)",
        }
        for number, name in enumerate(self._off, start=1):
            net = f"{all_but_piston}abs(fx-{self.name(f'net{number}')})"
            differences[name] = f"{net}/{force!r}"
        damped = scene.contact is not None
        lines = [
            *self._setting_commands(),
            "",
            *comment(
                "Does LAMMPS have these places, masses and forces? Unlike contacts, the wall and"
                f" all loads show in the net forces, here over {force:.4g} N, the largest"
                f"{' elastic' if damped else ''} force of a contact."
            ),
            *(f"variable off_{name} atom {formula}" for name, formula in differences.items()),
            *(f"compute off_{name} all reduce max v_off_{name}" for name in differences),
            f"thermo_style custom step {' '.join(f'c_off_{name}' for name in differences)}",
            NO_STEP,
            *(_kept(name) for name in ("misplaced", "heavier")),
            *(["fix speeds all store/state 0 vx"] if damped else []),
        ]
        for number, name in enumerate(self._off, start=1):
            speed = self.name(f"speed{number}") if damped else None
            lines += [*_moved(self.name(f"place{number}"), speed), NO_STEP, _kept(name)]
        lines += _moved(self.name("start"), "f_speeds" if damped else None)
        right = "*".join(f"(v_{name}<v_digits)" for name in (*self._off, "misplaced"))
        return [
            *lines,
            *(["unfix speeds"] if damped else []),
            "thermo_style one",
            "# Positions have so many digits, overlaps as much fewer as they are smaller.",
            f"variable digits equal {1e-11 + 1e-14 * length / shallowest:.3g}",
            f'variable law equal "{right}* &',
            '    (v_heavier<1e-11)"',
        ]

    def _setting_commands(self) -> list[str]:
        """Return the commands that store the known numbers of each granule."""
        scene = self._scene
        reach = "its radius and the next one's [m]"
        if scene.wall is not None:
            reach += " (the last: its radius less the wall's place)"
        speeds = ""
        if scene.contact is not None:
            q = scene.contact.exponent
            speeds = (
                "; speeds in these tests [m/s]; damping c in A overlap^(3/2) + c"
                f" overlap^{q:g} rate [N s m^-{1 + q:g}]"
            )
        each = {f"known_{name}": values.tolist() for name, values in self._columns.items()}
        return [
            "# ---- What is known of each granule and of its contact with the next",
            *comment(
                f"reach: {reach}; stiffness A in F = A overlap^(3/2) [N/m^1.5]; mass [kg]; place at"
                f" the start [m]; places in {len(self._tests)} tests that press all contacts, every"
                f" other one more [m], and the net forces there [N]{speeds}; the true peak force"
                " over F0, 0 if it is not judged, and the relative error allowed: what step and"
                " looks cost it, and coordinates may. None of these is from this LAMMPS."
            ),
            *(line for name, values in each.items() for line in _by_granule(name, values)),
            f"fix known all store/state 0 {' '.join(f'v_{name}' for name in each)}",
            NO_STEP,
        ]


def comment(text: str) -> list[str]:
    """Return text as lines of comment."""
    return textwrap.wrap(text, 98, initial_indent="# ", subsequent_indent="# ")


def _by_granule(name: str, values: list[float]) -> list[str]:
    """Return a variable with a value in each granule.

    A ``set`` for each would print three lines for each, which bury the verdict.
    """
    runs: list[tuple[int, int, float]] = []  # of neighbours with the same value
    for number, value in enumerate(values, start=1):
        if runs and runs[-1][2] == value:
            runs[-1] = (runs[-1][0], number, value)
        else:
            runs.append((number, number, value))
    terms = (
        f"+(id=={first})*{value!r}" if first == last else f"+(id>={first})*(id<={last})*{value!r}"
        for first, last, value in runs
    )
    lines = textwrap.wrap(" ".join(terms), 92, break_on_hyphens=False)
    return [
        f'variable {name} atom "0 &',
        *(f"    {line} &" for line in lines[:-1]),
        f'    {lines[-1]}"',
    ]


def _kept(name: str) -> str:
    return f"variable {name} equal $(c_off_{name}:%.17g)"


def _moved(place: str, speed: str | None) -> list[str]:
    lines = [f"variable place atom {place}", "set group all x v_place"]
    if speed is None:
        return lines
    return [
        *lines,
        f"variable speed atom {speed}",
        "velocity all set v_speed 0.0 0.0 units box",
    ]


def _test_force(scene: Scene) -> float:
    """Return the larger force of the check of the law [N]: no overlap is above R/10."""
    each = scene.granules
    deepest = float(np.min(each.stiffness)) * (float(np.min(each.radius)) / 10) ** 1.5
    return float(min(scene.units.force, deepest))


def _tests(scene: Scene, force: float) -> list[_Test]:
    if scene.contact is None:
        return [_test(scene, force, more_first) for more_first in (True, False)]
    return [_test(scene, force, number != 1, dampers) for number, dampers in enumerate(_DAMPERS)]


def _test(
    scene: Scene,
    force: float,
    more_first: bool,
    dampers: tuple[float, float] | None = None,
) -> _Test:
    """Test in which all contacts are pressed, every second one more; the wall stays in place."""
    each, contacts = scene.granules, scene.granules.stiffness.size
    more = np.arange(contacts) % 2 == (0 if more_first else 1)
    pressed = force * np.where(more, 1.0, 1 / _PRESSED_MORE)
    overlap = (pressed / each.stiffness) ** (2 / 3)
    between = scene.bodies - 1
    apart = each.radius[:-1] + each.radius[1:] - overlap[:between]
    position = np.concatenate([[0.0], np.cumsum(apart)])
    velocity = np.zeros(scene.bodies)
    if dampers is not None:
        assert scene.contact is not None
        assert each.damping is not None
        added = np.where(more, *dampers) * pressed
        fastest = _FASTEST * scene.units.velocity
        rate = added / (each.damping * overlap**scene.contact.exponent)
        rate = np.clip(rate, -fastest, fastest)
        velocity -= np.concatenate([[0.0], np.cumsum(rate[:between])])
        if scene.wall is not None:
            velocity += rate[-1] - velocity[-1]
        pressed = np.asarray(DampedLaw.of(scene).force(overlap, rate), np.float64)
    net = each.constant_force.copy()
    net[:-1] -= pressed[:between]
    net[1:] += pressed[:between]
    if scene.wall is not None:
        position += wall_position(scene) - each.radius[-1] + overlap[-1] - position[-1]
        net[-1] -= pressed[-1]
    return _Test(position, velocity, net)
