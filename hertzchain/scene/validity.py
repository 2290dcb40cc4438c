"""Limits of the model: Hertz's law holds for small overlaps."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.contact import hertz
from hertzchain.errors import OverlapTooLarge, RunFailed
from hertzchain.scene.chain import Chain
from hertzchain.scene.natural_units import force_scale
from hertzchain.scene.scene import Scene

DOUBTFUL_OVERLAP = 0.01
"""Overlap over radius above which Hertz's law is no longer exact: it needs a contact radius a far
below R (Johnson, Contact Mechanics, 1985, section 4.2). With a^2 = R overlap / 2, a is 0.07 R here,
and corrections to the law are of the order of the overlap over the radius."""

IMPOSSIBLE_OVERLAP = 1.0
"""Overlap over radius above which results are meaningless."""

_SURE_FORCE = 0.43
"""Fraction of the force scale that every largest peak exceeds. The smallest one measured is 0.454,
for two granules under a triangular pulse of LM_ratio 1.97 and n 1.001; two granules pushed slowly
have 0.5.
"""


def overlap_ratio(chain: Chain, peak_force: float) -> float:
    """Overlap of a contact under a force [N], over the radius R (Eq. 1 solved for the overlap)."""
    return float(math.pow(peak_force / chain.contact_stiffness, 2 / 3) / chain.radius)


def largest_overlap_ratio(scene: Scene, peak_force: FloatArray) -> float:
    """Return the largest overlap under the peaks of all contacts [N], over the smaller radius.

    The forces have the shape (contacts,); a wall's is the last.
    """
    if scene.is_plain:
        return overlap_ratio(scene.chain, float(peak_force.max()))
    granules = scene.granules
    smaller = np.append(np.minimum(granules.radius[:-1], granules.radius[1:]), granules.radius[-1])
    overlap = hertz.overlap_of(granules.stiffness, peak_force)
    return float(np.max(overlap / smaller[: overlap.size]))


def refuse_hopeless_overlap(scene: Scene) -> None:
    """Raise OverlapTooLarge, before a run, for a pulse or load certain to exceed the limit."""
    if scene.is_plain and scene.pulse is not None and scene.run.end_time is None:
        force = _SURE_FORCE * force_scale(scene.momentum_ratio) * scene.peak_force
        refuse_deep_overlap(overlap_ratio(scene.chain, force))
    if scene.precompression is not None:
        refuse_deep_overlap(largest_overlap_ratio(scene, scene.granules.static_force))


def refuse_deep_overlap(ratio: float, where: str = "") -> None:
    """Raise OverlapTooLarge for an overlap ratio at which Hertz's law does not apply."""
    if ratio > IMPOSSIBLE_OVERLAP:
        raise OverlapTooLarge(
            f"{where}the largest overlap would be {ratio:.3g} radii, above {IMPOSSIBLE_OVERLAP:g}:"
            " Hertz's law does not apply there; take a smaller force, larger granules or a stiffer"
            " material"
        )


def refuse_terms(scene: Scene, who: str, known: Collection[str] = ()) -> None:
    """Raise RunFailed for a scene with terms that a backend does not support."""
    unknown = [term for term in scene.terms if term not in known]
    if unknown:
        raise RunFailed(
            f"{who} does not support {', '.join(unknown)}: take a scene without, or run it with"
            " native, which has all terms"
        )


def overlap_warning(ratio: float) -> str | None:
    """Return the warning for an overlap ratio; None where no warning is due."""
    if ratio <= DOUBTFUL_OVERLAP:
        return None
    return (
        f"the largest overlap is {ratio:.2g} radii: Hertz's law, which is for overlaps below"
        f" {DOUBTFUL_OVERLAP:g}, is an extrapolation there (Johnson, Contact Mechanics, 1985,"
        " section 4.2)"
    )
