"""Damping and friction in a deck's contacts against the scene."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.verdict.deck.contact_numbers import QUIET, elsewhere, role_of
from hertzchain.verdict.deck.deck_check import Case, values
from hertzchain.verdict.deck.measured import Damper, dampers
from hertzchain.verdict.deck.number import Difference, Number, same

_CLEAR = 1e4  # times the rounding error, above which damping is wrong (chosen)


def _damping(case: Case) -> list[Difference]:
    """Damping of approaching and parting granules: the force added to a law of one power."""
    found = dampers(case.found, case.scene)
    if elsewhere(case) or not any(one.added.size for one in found):
        return []
    rooms = [_room(case, k, one) for k, one in enumerate(found)]
    k, at, most = _worst(found, rooms, approaching=True)
    if most <= _CLEAR:  # parting granules also show limits
        k, at, most = _worst(found, rooms, approaching=False)
    one, alike, wanted = found[k], np.array([k]), case.scene.contact is not None
    added, expected, room = (float(each[at]) for each in (one.added, one.expected, rooms[k]))
    if most <= 1:
        return [same(added, expected, room)]
    who = case.contact_name(alike)
    return [
        Difference(
            added, expected, f"damping of {who}", changes=_damped(case, found),
            relative=(added - expected) / max(abs(expected), 1e-300) if wanted else None,
            sentence=_sentence(one, at, who), role=role_of(case, alike), room=room,
        )
    ]  # fmt: skip


def _room(case: Case, k: int, one: Damper) -> FloatArray:
    """Rounding error at each try [N], of the force or, if that is larger, of damping."""
    share = 2 * case.rounding(k, one.overlap) if case.exact else QUIET
    return np.asarray(share * np.maximum(one.elastic, np.abs(one.expected)))


def _worst(
    found: list[Damper], rooms: list[FloatArray], approaching: bool
) -> tuple[int, int, float]:
    """The contact and the try with the largest difference, and its ratio to the rounding error."""
    worst, at, most = 0, 0, 0.0
    for k, one in enumerate(found):
        off, room = np.abs(one.added - one.expected), rooms[k]
        off = np.divide(off, room, out=np.where(off > 0, np.inf, 0.0), where=room > 0)
        if approaching:
            off = np.where(one.closing > 0, off, 0.0)
        if not np.max(off, initial=0.0) <= most:
            worst, at, most = k, int(np.argmax(off)), float(np.max(off))
    return worst, at, most


def _sentence(one: Damper, at: int, who: str) -> str:
    """The force of damping in one try, in words."""
    added, expected, elastic = float(one.added[at]), float(one.expected[at]), one.elastic[at]
    how = "approach" if one.closing[at] > 0 else "part"
    when = f"granules {how} with {abs(one.closing[at]):.3g} m/s"
    if added < -elastic and math.isclose(expected, -elastic, rel_tol=1e-6):
        return (
            f"{who} pulls: where {when}, damping is {added:.4g} N and the elastic force"
            f" {elastic:.3g} N; contacts of the scene do not pull"
        )
    numbers = values(added, expected, "N")
    return f"damping of {who} {numbers}, where {when} and the elastic force is {elastic:.3g} N"


def damping_of_twin(case: Case) -> dict[str, Any]:
    """Numbers of a twin that has the damping of the deck."""
    return _damped(case, dampers(case.found, case.scene))


def _damped(case: Case, found: list[Damper]) -> dict[str, Any]:
    """Numbers of a twin with the damping of the deck: c overlap^q d' from the largest tries."""
    # Round-off has no exponent.
    found = [
        replace(one, added=np.where(np.abs(one.added) > QUIET * one.elastic, one.added, 0.0))
        for one in found
    ]
    power = case.twin.damping_exponent if case.scene.contact is not None else _power_of(found)
    damping, pulls = np.array(case.twin.damping), False
    for k, one in enumerate(found):
        closing = one.closing > 0
        if not closing.any():
            continue
        deep = int(np.argmax(np.where(closing, one.overlap, 0.0)))
        damping[k] = one.added[deep] / (one.overlap[deep] ** power * one.closing[deep])
        pulls = pulls or bool(np.any(one.elastic + one.added < -QUIET * one.elastic))
    return {"damping": damping, "damping_exponent": power, "attraction": pulls}


def _power_of(found: list[Damper]) -> float:
    """Exponent q of damping that the scene lacks, from the smallest and the largest overlap."""
    for one in found:
        closing = (one.closing > 0) & (np.abs(one.added) > 0)
        if np.count_nonzero(closing) >= 2:
            overlap, rate = one.overlap[closing], one.added[closing] / one.closing[closing]
            low, high = int(np.argmin(overlap)), int(np.argmax(overlap))
            if overlap[high] > overlap[low] and rate[high] * rate[low] > 0:
                power = math.log(rate[high] / rate[low]) / math.log(overlap[high] / overlap[low])
                return round(4 * power) / 4
    return 0.5


def _friction(case: Case) -> Difference:
    """Sideways forces and torques over radius when granules spin: the scene has none."""
    unit = float(np.min(case.twin.stiffness * case.near**1.5))
    of_walls = [wall.tangential_force for wall in case.found.walls]
    sideways = float(np.nanmax(np.abs([*case.found.tangential_force, *of_walls]), initial=0.0))
    still = np.max(np.abs(case.found.spin), initial=0.0) == 0
    return Difference(
        sideways, 0.0, effect=0.0 if still else case.whole_effect,
        sentence=f"friction: granules that spin are pushed sideways or turned by {sideways:.3g} N,"
        " the scene has no friction", room=case.least(QUIET) * unit,
    )  # fmt: skip


DAMPING = (
    Number(
        "damping",
        "N",
        "contacts",
        _damping,
        "forces of approaching and parting granules; a scene without damping has none",
    ),
    Number(
        "friction",
        "N",
        "contacts",
        _friction,
        "sideways forces and torques over radius when granules spin, of the contact force: they"
        " do nothing while granules stay on the axis without spin",
    ),
)
