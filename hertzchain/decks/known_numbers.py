"""Known numbers of each granule in a deck; none of them is from LAMMPS."""

from __future__ import annotations

import textwrap

import numpy as np

from hertzchain.decks.layout import KnownAnswer
from hertzchain.engines.external.terms import wall_position
from hertzchain.engines.lammps.dialect import NO_STEP
from hertzchain.scene.scene import Scene


class KnownNumbers:
    """Known numbers of each granule, in the columns ``f_known[1]`` and so on."""

    def __init__(self, scene: Scene, known: KnownAnswer) -> None:
        self._scene, each = scene, scene.granules
        granules = scene.bodies
        reach = np.append(each.radius[:-1] + each.radius[1:], 0.0)
        if scene.wall is not None:
            reach[-1] = each.radius[-1] - wall_position(scene)
        self._columns = {
            "reach": reach,
            "stiffness": np.append(each.stiffness, 0.0)[:granules],
        }
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

    def commands(self) -> list[str]:
        """Return the commands that store the known numbers of each granule."""
        scene = self._scene
        reach = "its radius and the next one's [m]"
        if scene.wall is not None:
            reach += " (the last: its radius less the wall's place)"
        damping = ""
        if scene.contact is not None:
            q = scene.contact.exponent
            damping = f"; damping c in A overlap^(3/2) + c overlap^{q:g} rate [N s m^-{1 + q:g}]"
        each = {f"known_{name}": values.tolist() for name, values in self._columns.items()}
        return [
            "# ---- What is known of each granule and of its contact with the next",
            *comment(
                f"reach: {reach}; stiffness A in F = A overlap^(3/2) [N/m^1.5]{damping}; the true"
                " peak force over F0, 0 if it is not judged, and the relative error allowed: what"
                " step and looks cost it, and coordinates may. None of these is from this LAMMPS."
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

    A ``set`` for each granule would print three lines each, and hide the verdict among them.
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
