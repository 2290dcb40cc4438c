"""Mistakes in damping: added, missing, of another law or with another coefficient."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.damping import BEFORE_ROOT_2, WITH_ROOT_2, tsuji
from hertzchain.engines.yade.damping import BETAN_PER_RATIO, betan
from hertzchain.errors import SceneError
from hertzchain.scene.keys import keys_of
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import DAMPING, Contact, DampingLaw
from hertzchain.theory.restitution import damping_ratio, of_ratio, ratio_for
from hertzchain.verdict.case import Case, Found, Mistake, fixed
from hertzchain.verdict.slips import near

_TRIALS = np.log(np.geomspace(1e-6, 2.2, 14))
"""Logarithms of trial coefficients in natural units; sqrt(5) is a restitution of 0."""

_BETTER = 3.0
"""Factor by which a coefficient, or contacts that pull, must leave less to be named (chosen)."""

_HELPS = 0.9
"""Part of the differences of an elastic scene: a law whose best trial leaves more is dropped. If
the law is the cause, a trial within a factor of 1.8 of the coefficient leaves about 0.6.
"""

_SAME = 3e-4
"""Largest relative distance from the scene's coefficient that counts as equal."""

_KNOWN_TO = 1e-4
"""Least relative uncertainty of a coefficient; that of trial runs and search is smaller."""

_HIDDEN = 4.0
"""Ratio of a coefficient's true error to the one derived from the residual, because errors of steps
change it too (measured 4, for velocity Verlet).
"""

_NAMES = {
    "restitution": "damping of restitution",
    "viscoelastic": "damping of viscoelastic spheres with the relaxation time",
    "dashpot": "damping by dashpots of",
}


@dataclass(frozen=True)
class _Fitted:
    """A law of damping with its fitted coefficient."""

    contact: Contact
    log: float  # logarithm of the coefficient, natural units
    uncertainty: float  # relative


_NOTHING = Found(None, math.inf)


def damping(case: Case) -> Iterator[Mistake]:
    """Yield no damping, another law, another coefficient, and contacts that pull or not."""
    scene, own = case.scene, case.scene.contact
    without, pulls = case.size, own is not None and own.attraction
    if own is not None:
        elastic = case.of(_with(scene, None))
        without = case.residual(elastic)
        yield fixed("no damping", elastic)
        text = "contacts that are kept from pulling" if pulls else "contacts that pull as they open"
        yield fixed(text, case.of(_with(scene, replace(own, attraction=not pulls))))
    for law in DAMPING:
        yield Mistake(
            lambda found: _in_words(case, found, pulls),
            search=functools.partial(_search, law=law, pulls=pulls, without=without),
        )


def _search(case: Case, law: DampingLaw, pulls: bool, without: float) -> Found:
    """Find the coefficient of a law, and whether contacts pull under it."""
    found = _fit(case, law, pulls, _TRIALS, without)
    if found.left > case.size / 2:
        return _NOTHING
    trials = found.value.log + 0.1 * np.linspace(-1.0, 1.0, 5)
    other_way = _fit(case, law, not pulls, trials, without)
    if other_way.left < found.left / _BETTER:
        found = other_way
    if found.left > without / _BETTER or _is_own(case.scene, found.value):
        return _NOTHING
    return found


def _fit(case: Case, law: DampingLaw, attraction: bool, logs: FloatArray, without: float) -> Found:
    """Fit the coefficient of a law; nothing where none can be tried, or none helps.

    Damping changes peaks in proportion to its coefficient, so the part that it leaves of what they
    differ by without any is about the relative uncertainty.
    """

    @functools.cache
    def made(log: float) -> FloatArray:
        contact = contact_of(case.scene, law, math.exp(log), attraction)
        return case.of(_with(case.scene, contact))

    allowed = [log for log in logs.tolist() if law != "restitution" or log < _TRIALS[-1] + 1e-9]
    if case.scene.contact is None:
        best = min(case.residual(made(log)) for log in allowed)
        if best > _HELPS * case.size:
            return _NOTHING
    found = case.fit(made, allowed)
    if not math.isfinite(found.left):
        return _NOTHING
    contact = contact_of(case.scene, law, math.exp(found.value), attraction)
    uncertainty = min(max(_HIDDEN * found.left / without, _KNOWN_TO), 1.0)
    return replace(found, value=_Fitted(contact, found.value, uncertainty))


def _with(scene: Scene, contact: Contact | None) -> Scene:
    """Return the scene with another damping of all contacts, also the wall's."""
    wall = None if scene.wall is None else scene.wall.damped(None)
    return replace(scene, contact=contact, wall=wall)


def contact_of(scene: Scene, law: DampingLaw, strength: float, attraction: bool) -> Contact:
    """Return a law of damping with the coefficient ``strength`` in natural units.

    It is c in F = d^(3/2) + c d^q d', and alpha in the law of restitution.
    """
    units = scene.units
    if law == "restitution":
        parameter = of_ratio(strength / math.sqrt(5), pulls=True)
    elif law == "viscoelastic":
        parameter = strength / 1.5 * units.time
    else:
        parameter = strength * units.force * units.time / units.length
    return Contact(law, attraction=attraction, **{DAMPING[law]: parameter})


def strength_of(scene: Scene, contact: Contact) -> float:
    """Return the ``strength`` of ``contact_of`` for a law of damping."""
    units = scene.units
    if contact.restitution is not None:
        return math.sqrt(5) * damping_ratio(contact.restitution)
    if contact.damping == "viscoelastic":
        return 1.5 * contact.parameter / units.time
    return contact.parameter * units.length / (units.force * units.time)


def _is_own(scene: Scene, found: _Fitted) -> bool:
    """Return whether the fit is the scene's own law and coefficient."""
    own = scene.contact
    if own is None or own.damping != found.contact.damping:
        return False
    return abs(math.exp(found.log) / strength_of(scene, own) - 1) < _SAME


def _in_words(case: Case, found: _Fitted, base: bool) -> str:
    own, same = case.scene.contact, False
    text = described(found.contact, found.uncertainty)
    if own is not None:
        same = own.damping == found.contact.damping
        text += f" in place of {(_value if same else described)(own, _KNOWN_TO)}"
    if found.contact.attraction != base:
        text += ", with contacts that pull" if not base else ", with contacts that cannot pull"
    if own is not None and same:
        factor = math.exp(found.log) / strength_of(case.scene, own)
        text += f" (coefficient {factor:.4g} times the scene's)"
        names = near(known_factors(case.scene), factor)
        text += f": {' or '.join(names)}" if names else ""
    return text


def described(contact: Contact, uncertainty: float) -> str:
    """Return the words for a law and its coefficient, with its known digits.

    ``uncertainty`` is the relative uncertainty of the coefficient.
    """
    return f"{_NAMES[contact.damping]} {_value(contact, uncertainty)}"


def _value(contact: Contact, uncertainty: float) -> str:
    digits = max(2, math.floor(-math.log10(uncertainty)))
    if contact.restitution is not None:
        e = contact.restitution
        # Derivative of ln e = -pi z / sqrt(1 - z^2).
        off = uncertainty * e * -math.log(e) / (1 - damping_ratio(e) ** 2)
        return f"{round(e, max(2, math.floor(-math.log10(off)))):.10g}"
    unit = keys_of(Contact)[DAMPING[contact.damping]].unit
    return f"{contact.parameter:.{digits}g} {unit}"


def known_factors(scene: Scene) -> dict[str, float]:
    """Return factors of the coefficient of a law by known mistakes, by name."""
    contact = scene.contact
    assert contact is not None
    if contact.damping == "viscoelastic":
        return {"the factor 3/2 is missing": 2 / 3, "the factor 3/2 is there twice": 3 / 2}
    if contact.restitution is None:
        return {"half of the coefficient": 0.5, "twice the coefficient": 2.0}
    e = contact.restitution
    ratio = damping_ratio(e)
    known = {
        f"damping tsuji of LAMMPS {version} for {e:g}": tsuji(e, root_2) / (math.sqrt(5) * ratio)
        for version, root_2 in ((BEFORE_ROOT_2, False), (WITH_ROOT_2, True))
    }
    try:
        limited = ratio_for(e, pulls=False)
    except SceneError:  # contacts that cannot pull never have such a small restitution
        limited = math.nan
    known |= {
        f"the coefficient with which contacts that cannot pull have {e:g}": limited / ratio,
        f"en = {e:g} of Yade": betan(e) / BETAN_PER_RATIO / ratio,
    }
    if not {"unlike granules", "wall"} & set(scene.terms):
        known |= {"m in place of m*": math.sqrt(2), "m*/2 in place of m*": math.sqrt(0.5)}
    return known
