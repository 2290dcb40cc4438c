"""Damping and friction in a deck's contacts against the scene."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np

from hertzchain.verdict.deck.contact_names import contact_name, reduced_modulus, role_of
from hertzchain.verdict.deck.deck_check import Case, DeckCheck, placed, same, values
from hertzchain.verdict.deck.measured import Damper, dampers
from hertzchain.verdict.deck.places import place

_CLEAR = 1e-3  # of a contact force: damping that is off by more is wrong (chosen)
QUIET = 1e-7  # of a contact force: damping and friction below are round-off (chosen)


def damping_check(case: Case) -> list[DeckCheck]:
    """Damping by approaching and parting granules."""
    found = dampers(case.found, case.scene, list(case.laws))
    worst, at, most = _worst(found, approaching=True)
    if most <= _CLEAR:  # granules that part tell of limits, too
        worst, at, most = _worst(found, approaching=False)
    wanted = case.scene.contact
    if most <= QUIET:
        return [same("damping", "N", 0.0, 0.0, "forces of approaching and parting granules")]
    one = found[worst]
    added, expected = float(one.added[at]), float(one.expected[at])
    change = case.effect(**_damped(case, found))
    who = contact_name(np.array([worst]), case)
    relative = (added - expected) / max(abs(expected), 1e-300)
    allowed = wanted is not None and case.allowed(change, relative)
    law = "none" if wanted is None else wanted.damping
    check = DeckCheck(
        f"damping of {who}", "N", added, expected, change, allowed, True,
        _sentence(one, at, who), case.reason if wanted is not None else "the scene has no damping",
    )  # fmt: skip
    where = place(case.found, role_of(np.array([worst]), case))
    text = "" if where is None else case.found.commands[where.index].text
    right = _right_damping(case, text, law, worst)
    return [placed(check, case.found, role_of(np.array([worst]), case), (), right)]


def _worst(found: list[Damper], approaching: bool) -> tuple[int, int, float]:
    """The contact and the try that is off the most, and by how much; of approaching granules."""
    worst, at, most = 0, 0, 0.0
    for k, one in enumerate(found):
        if one.added.size == 0:
            continue
        off, scale = np.abs(one.added - one.expected), np.maximum(one.elastic, np.abs(one.expected))
        off = np.divide(off, scale, out=np.where(off > 0, np.inf, 0.0), where=scale > 0)
        if approaching:
            off = np.where(one.closing > 0, off, 0.0)
        if not np.max(off) <= most:
            worst, at, most = k, int(np.argmax(off)), float(np.max(off))
    return worst, at, most


def _sentence(one: Damper, at: int, who: str) -> str:
    """What damping does in one try, in words."""
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


def damping_numbers(case: Case) -> dict[str, object]:
    """Numbers of a twin that is damped as the deck is."""
    return _damped(case, dampers(case.found, case.scene, list(case.laws)))


def _damped(case: Case, found: list[Damper]) -> dict[str, object]:
    """Numbers of a twin that is damped as the deck is: c overlap^q d' by the largest tries."""
    contact = case.scene.contact
    # Round-off has no exponent.
    found = [
        replace(one, added=np.where(np.abs(one.added) > QUIET * one.elastic, one.added, 0.0))
        for one in found
    ]
    power = case.twin.damping_exponent if contact is not None else _power_of(found)
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
    """The q of a damping that the scene has not: by the smallest and the largest overlap tried."""
    for one in found:
        closing = (one.closing > 0) & (np.abs(one.added) > 0)
        if np.count_nonzero(closing) >= 2:
            overlap, rate = one.overlap[closing], one.added[closing] / one.closing[closing]
            low, high = int(np.argmin(overlap)), int(np.argmax(overlap))
            if overlap[high] > overlap[low] and rate[high] * rate[low] > 0:
                power = math.log(rate[high] / rate[low]) / math.log(overlap[high] / overlap[low])
                return round(4 * power) / 4
    return 0.5


def _right_damping(case: Case, text: str, law: str, k: int) -> str:
    """The line of a contact law with the damping of the scene."""
    contact, granules, unit = case.scene.contact, case.scene.granules, case.units
    if contact is None:
        eta, option = "0.0", ""
    elif contact.restitution is not None:
        eta, option = f"{contact.restitution:.10g}", " damping coeff_restitution"
    elif contact.relaxation_time is not None:
        rate = 2 * contact.relaxation_time * reduced_modulus(case, k)
        mass = float(granules.contact_mass[min(k, granules.contact_mass.size - 1)])
        eta = f"{rate / mass * unit.length * unit.time:.10g}"
        option = " damping viscoelastic"
    else:
        assert contact.coefficient is not None
        eta, option = f"{contact.coefficient / unit.mass * unit.time:.10g}", " damping velocity"
    styles = [one.text for one in case.found.commands if one.text.startswith("pair_style")]
    if "gran/" in (styles[-1] if styles else "") and "wall/" not in text:
        words = styles[-1].split()
        at = next(j for j, word in enumerate(words) if word.startswith("gran/"))
        return " ".join([*words[: at + 3], eta if law == "viscoelastic" else "0.0", "0.0", "0.0",
                         "0", *words[at + 7 :]])  # fmt: skip
    changed = re.sub(r"(hertz/material\s+\S+|\bhertz\s+\S+)\s+\S+", rf"\1 {eta}", text)
    if contact is not None:
        changed = re.sub(r"\s+damping\s+\S+", "", changed) + option
        if not contact.attraction and "limit_damping" not in changed:
            changed += " limit_damping"
    return changed


def friction_check(case: Case) -> DeckCheck:
    """Forces across the contacts when granules spin: the scene has none."""
    unit = float(np.max([law.stiffness for law in case.laws])) * float(np.max(case.near)) ** 1.5
    sideways = float(np.nanmax(np.abs(case.found.tangential_force), initial=0.0))
    why = "sideways forces and torques over radius when granules spin, of the contact force"
    if sideways <= QUIET * max(unit, 1e-300):
        return same("friction", "N", sideways, 0.0, why)
    still = np.max(np.abs(case.found.spin), initial=0.0) == 0
    check = DeckCheck(
        "friction", "N", sideways, 0.0, 0.0 if still else case.whole_effect, False, True,
        f"friction: granules that spin are pushed sideways or turned by {sideways:.3g} N, the scene"
        " has no friction",
        "the scene has no friction; it does nothing while granules stay on the axis without spin",
    )  # fmt: skip
    where = place(case.found, "contacts")
    text = "" if where is None else case.found.commands[where.index].text
    right = re.sub(r"tangential\s+\S+(?:\s+(?:NULL|[-+.\deE]+))+",
                   "tangential linear_nohistory 0.0 0.0", text)  # fmt: skip
    right = re.sub(r"\s+(?:rolling|twisting)\s+\S+(?:\s+[-+.\deE]+)*", "", right)
    styles = [one.text for one in case.found.commands if one.text.startswith("pair_style")]
    if "gran/" in (styles[-1] if styles else ""):
        words = styles[-1].split()
        at = next(j for j, word in enumerate(words) if word.startswith("gran/"))
        right = " ".join([*words[: at + 4], "0.0", "0.0", *words[at + 6 :]])
    return placed(check, case.found, "contacts", (), right)
