"""How backends and profiles look in every figure: colours that the colour-blind tell apart."""

from __future__ import annotations

from typing import Any

_OPEN = {"linestyle": "none", "fillstyle": "none"}

BACKENDS: dict[str, dict[str, Any]] = {
    "native": {"label": "native", "color": "#000000", "marker": "o", "markersize": 5} | _OPEN,
    "lammps": {"label": "LAMMPS", "color": "#0072B2", "marker": "s", "markersize": 9} | _OPEN,
}
"""Open markers of two sizes: where both agree, one is seen inside the other."""

PROFILES: dict[str, dict[str, Any]] = {
    "cosine": {"label": "1-cosine", "color": "#0072B2", "marker": "o"},
    "triangular": {"label": "triangular", "color": "#D55E00", "marker": "s"},
    "cosine-triangular": {
        "label": "1-cosine rise, triangular decay",
        "color": "#009E73",
        "marker": "^",
    },
}
"""The three of Table 1."""
