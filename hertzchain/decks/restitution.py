"""Restitution that damping options of LAMMPS, LIGGGHTS and Yade really give.

Each option takes a number. Some options call it a coefficient of restitution, and the spheres part
with that restitution or with another one. The others take a coefficient of damping, and the
restitution depends on the two spheres and on the velocity of their impact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from scipy.optimize import brentq

from hertzchain.engines.lammps import damping as lammps
from hertzchain.engines.yade import damping as yade
from hertzchain.errors import SceneError, is_finite, require
from hertzchain.theory import restitution as theory
from hertzchain.theory.restitution import DASHPOT, VISCOELASTIC, Collision

RESTITUTION, RATIO = "restitution", "1"
"""Kinds of an option's number; any other kind is the unit of a coefficient of damping."""


@dataclass(frozen=True)
class Option:
    """A damping option of a code.

    Parameters
    ----------
    code, versions
        Program and versions.
    words
        The words of the option in a deck.
    pulls
        Whether contacts pull as they open.
    number
        Kind of the number: ``RESTITUTION``, ``RATIO`` or a unit.
    least, most
        Allowed range of a number that is a restitution; 1 is always allowed.
    """

    code: str
    versions: str
    words: str
    pulls: bool
    number: str
    # Function from the number to the damping ratio alpha / sqrt(5); None for other laws.
    ratio: Callable[[float], float] | None = field(default=None, repr=False)
    # For other laws: the exponent of the overlap in eta, and the coefficient c for the number 1.
    exponent: float = DASHPOT
    damping: Callable[[Collision], float] | None = field(default=None, repr=False)
    least: float = 0.0
    most: float = 1.0

    @property
    def needs_spheres(self) -> bool:
        """True if the restitution depends on the spheres and the velocity of their impact."""
        return self.ratio is None

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest restitution of an option that takes one, except for the number 1."""
        return self.restitution(self.least), self.restitution(self.most)

    def restitution(self, number: float, collision: Collision | None = None) -> float:
        """Return the coefficient of restitution that a number gives.

        SceneError for a number that the program does not take.
        """
        of_what = f"{self.least:g} to 1" if self.number == RESTITUTION else "0 on"
        allowed = f"must be a finite number from {of_what} for {self}"
        require(self.takes(number), "number", number, allowed)
        if self.ratio is not None:
            return theory.of_ratio(self.ratio(number), self.pulls)
        return theory.of_natural(number * self._natural(collision), self.exponent, self.pulls)

    def number_for(self, wanted: float, collision: Collision | None = None) -> float:
        """Return the number to write for a coefficient of restitution.

        SceneError where no number gives it.
        """
        theory.check_wanted(wanted)
        if self.ratio is None:
            one = self._natural(collision)
            return theory.natural_for(wanted, self.exponent, self.pulls) / one
        if self.number == RATIO:
            return theory.ratio_for(wanted, self.pulls) / self.ratio(1.0)
        if self.restitution(1.0) == wanted:
            return 1.0
        lowest, highest = self.range
        allowed = f"is impossible with {self}, which gives {lowest:.4g} to {highest:.6g}"
        allowed += ": take another option"
        require(lowest <= wanted <= highest, "restitution", wanted, allowed)

        def too_high(number: float) -> float:
            return self.restitution(number) - wanted

        return float(brentq(too_high, self.least, self.most, xtol=1e-14, rtol=1e-14))

    def __str__(self) -> str:
        """Name words, code and versions."""
        return f"{self.words} of {self.code} ({self.versions})"

    def takes(self, number: float) -> bool:
        """Return whether the program takes a number."""
        if self.number != RESTITUTION:
            return is_finite(number) and number >= 0
        return is_finite(number) and (self.least <= number <= self.most or number == 1)

    def _natural(self, collision: Collision | None) -> float:
        """Return the damping in natural units for the number 1."""
        if collision is None or self.damping is None:
            allowed = "needs two spheres and the velocity of their impact"
            raise SceneError("", None, f"the restitution of {self} {allowed}: give a collision")
        return self.damping(collision) / collision.unit(self.exponent)


def _lammps(versions: str, words: str, number: str, **law: object) -> Iterator[Option]:
    """Yield an option of LAMMPS without and with ``limit_damping``."""
    for pulls, limit in ((True, ""), (False, " limit_damping")):
        words_now = f"damping {words}{limit}"
        yield Option("LAMMPS", versions, words_now, pulls, number, **law)  # type: ignore[arg-type]


def _tsuji(root_2: bool) -> Callable[[float], float]:
    return lambda number: lammps.tsuji(number, root_2) / 5**0.5


_TINY = 1e-9
"""Smallest restitution written for options that allow any value above 0 (chosen)."""

OPTIONS = (
    *_lammps(lammps.BEFORE_ROOT_2, "tsuji", RESTITUTION, ratio=_tsuji(False)),
    *_lammps(lammps.WITH_ROOT_2, "tsuji", RESTITUTION, ratio=_tsuji(True)),
    *_lammps(
        lammps.WITH_COEFF_RESTITUTION, "coeff_restitution", RESTITUTION,
        ratio=theory.damping_ratio, least=_TINY,
    ),
    Option(
        "LIGGGHTS", "3.8.0", "coefficientRestitution", True, RESTITUTION,
        ratio=theory.damping_ratio, least=0.05 + _TINY,
    ),
    Option(
        "LIGGGHTS", "3.8.0", "coefficientRestitution, limitForce on", False, RESTITUTION,
        ratio=theory.damping_ratio, least=0.05 + _TINY,
    ),
    # Below 1 its fit ends at 0.9846; 1 itself damps nothing.
    Option(
        "Yade", yade.VERSION, "en", False, RESTITUTION,
        ratio=lambda number: yade.betan(number) / yade.BETAN_PER_RATIO, least=1e-3, most=1 - _TINY,
    ),
    Option(
        "Yade", yade.VERSION, "betan", False, RATIO,
        ratio=lambda number: number / yade.BETAN_PER_RATIO,
    ),
    *_lammps(lammps.SINCE_2021, "velocity", "kg/s", damping=lambda _: 1.0),
    *_lammps(
        lammps.SINCE_2021, "mass_velocity", "1/s", damping=lambda collision: collision.mass
    ),
    *_lammps(
        lammps.SINCE_2021, "viscoelastic", "1/(m s)", exponent=VISCOELASTIC,
        damping=lambda collision: collision.mass * collision.radius**0.5,
    ),
)  # fmt: skip
"""Options by code; those that need two spheres last."""


@dataclass(frozen=True)
class Answer:
    """Restitution that an option gives, and the number that it needs; None where impossible.

    Parameters
    ----------
    option
        The option.
    written
        The number whose restitution is ``gives``: the wanted restitution, or a given coefficient.
    gives
        The restitution of ``written``; None where nothing is written or the program refuses it.
    write
        The number to write for the wanted restitution.
    why_none
        Reason why no number gives the wanted restitution, a sentence.
    """

    option: Option
    written: float | None
    gives: float | None
    write: float | None
    why_none: str | None

    def to_dict(self) -> dict[str, object]:
        """Return all fields as a JSON object."""
        option = self.option
        return {
            "code": option.code,
            "versions": option.versions,
            "option": option.words,
            "contacts_pull": option.pulls,
            "number_is": "damping ratio" if option.number == RATIO else option.number,
            "written": self.written,
            "gives": self.gives,
            "write": self.write,
            "why_none": self.why_none,
        }


def answers(
    wanted: float, collision: Collision | None = None, coefficient: float | None = None
) -> list[Answer]:
    """Return for each option the restitution it gives and the number to write for a wanted one.

    Parameters
    ----------
    wanted
        Coefficient of restitution, 0.001 to 1; passed unchanged to every option that takes one.
    collision
        Two spheres and their velocity; without them, options that need them are left out.
    coefficient
        Number for every option that takes a coefficient of damping with a unit.

    Raises
    ------
    SceneError
        For an impossible restitution.
    """
    theory.check_wanted(wanted)
    found = []
    for option in OPTIONS:
        if option.needs_spheres and collision is None:
            continue
        written = coefficient if option.needs_spheres else wanted
        written = None if option.number == RATIO else written
        takes = written is not None and option.takes(written)
        gives = option.restitution(written, collision) if written is not None and takes else None
        try:
            write, why_none = option.number_for(wanted, collision), None
        except SceneError as problem:
            write, why_none = None, str(problem)
        found.append(Answer(option, written, gives, write, why_none))
    return found
