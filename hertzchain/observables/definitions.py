"""The definitions of the numbers in results, by a version; what lets a JSON document stand alone.

Version 2. Contact i lies between granules i - 1 and i, i = 2 ... N; with a wall contact N + 1 lies
between granule N and the wall (in version 1 it stood apart), and with a near wall contact 1 between
that and granule 1. A peak is the true maximum of a
contact force over the run. LM_ratio is the impulse of the shock over the momentum of a solitary
wave as high as it, with the paper's 139/32. p is the number of granules after which peaks of
neighbours differ by less than 1 %, at least 5; F_SW is the peak of contact p + 1, and the
far-field force that of the last contact which the free end does not touch. The largest pressure
is Hertz's p0 = 3 F / (2 pi a^2) at a peak, and the needed yield strength p0 / 1.60.
``error_estimate`` bounds the relative error of every peak of at least 1e-3 of the largest, against
the exact solution of Eq. 1.
"""

from __future__ import annotations

import platform
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

from hertzchain.scene.file import sections_of
from hertzchain.scene.scene import Scene

DEFINITIONS = 2
"""Raised when the definition of a number changes; not when its digits improve."""


def provenance(versions: Mapping[str, str]) -> dict[str, str]:
    """Return versions with those of hertzchain and Python, and the machine."""
    return {
        "hertzchain": version("hertzchain"),
        **versions,
        "python": platform.python_version(),
        "platform": platform.platform(),
    }


def context_of(scene: Scene) -> dict[str, Any]:
    """Return the scene, contacts and versions that a JSON document contains besides its numbers."""
    return {
        "scene": sections_of(scene),
        "contacts": list(scene.contacts),
        "definitions": DEFINITIONS,
        "hertzchain": version("hertzchain"),
    }
