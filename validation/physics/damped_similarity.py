"""Damped chains under forces from 1e-6 to 100 N, and the laws under which they are similar.

In natural units a law c d^q d' has the coefficient c F0^(2q/3 - 1/6): that of restitution is the
same at all forces, those of dashpots and of viscoelastic spheres are not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import hertzchain as hc
from validation.physics.chains import steel
from validation.rows import Row, row
from validation.script import Script, rows_only

LAWS = {
    "restitution": (hc.Contact("restitution", restitution=0.8), 0.0),
    "dashpot": (hc.Contact("dashpot", coefficient=5.0), -1 / 6),
    "viscoelastic": (hc.Contact("viscoelastic", relaxation_time=1e-6), 1 / 6),
}
"""A law for 1 N, and with which power of the force its coefficient in natural units goes."""

WEAK = {
    "restitution": hc.Contact("restitution", restitution=0.9999),
    "dashpot": hc.Contact("dashpot", coefficient=5e-4),
    "viscoelastic": hc.Contact("viscoelastic", relaxation_time=1e-10),
}
"""Damping that takes about 1e-4 of the peaks."""

FORCES = (1e-6, 1e-3, 100.0)
"""Largest forces of the pulse [N]."""

_PULSE = hc.Pulse("cosine", 1.0, 2.0, momentum_ratio=1.0)

_ROUNDING = 1e-10
_SAME = (
    "native computes in natural units, so only the conversion differs: 7e-15 measured, and 2e-11"
    " where round-off tips the choice of one step; a tenth of the accuracy asked for, 1e-9"
)
_WEAK = "terms of the second power of the coefficient: 7e-6 measured"


def compare(quick: bool, _: bool) -> list[Row]:
    """Rows of each law and force; the quick form has one force."""
    rows = []
    for law, (contact, power) in LAWS.items():
        before = run(1.0, contact)
        for force in FORCES[:1] if quick else FORCES:
            after = run(force, rescaled(contact, force**-power))
            peaks = after.peak_force / before.peak_force / force
            times = after.peak_time / before.peak_time * force ** (1 / 6)
            known = (
                "the same coefficient" if power == 0 else f"coefficient * (F0 / N)^({-power:+.3g})"
            )
            what = f"{law}, {force:g} N, {known}"
            off = float(np.max(np.abs(peaks - 1)))
            rows.append(row(f"{what}: peaks / F0", "native", off, 0.0, _ROUNDING, _SAME))
            off = float(np.max(np.abs(times - 1)))
            rows.append(row(f"{what}: times / T", "native", off, 0.0, _ROUNDING, _SAME))
            share = lost(force, WEAK[law]) / lost(1.0, WEAK[law])
            what = f"{law}, {force:g} N, weak, the same coefficient: exponent of the loss"
            found = float(np.log(share) / np.log(force))
            rows.append(row(what, "native", found, power, 1e-4, _WEAK))
    return rows


def run(force: float, contact: hc.Contact | None) -> hc.Result:
    """A pulse on 30 granules; the same in natural units at all forces."""
    scene = hc.Scene(steel(30), replace(_PULSE, peak_force=force), contact=contact)
    return hc.Native(rtol=1e-9).run(scene)


def rescaled(contact: hc.Contact, factor: float) -> hc.Contact:
    """The same law with its coefficient times a factor; a restitution has none."""
    if contact.coefficient is not None:
        return replace(contact, coefficient=contact.coefficient * factor)
    if contact.relaxation_time is not None:
        return replace(contact, relaxation_time=contact.relaxation_time * factor)
    return contact


def lost(force: float, contact: hc.Contact) -> float:
    """Return the logarithm of the ratio by which damping lowers the peak of contact 26."""
    return float(np.log(run(force, None).peak_force[24] / run(force, contact).peak_force[24]))


SCRIPT = Script(
    "Similarity of damped chains",
    "Is a damped chain similar at all forces under the law of restitution, and under that alone?",
    "native; similarity of the equations",
    **rows_only(compare),
)

if __name__ == "__main__":
    SCRIPT.main()
