"""Styles of backends and profiles in all figures: colours distinct for colour-blind readers."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

_OPEN = {"linestyle": "none", "fillstyle": "none"}

BACKENDS: dict[str, dict[str, Any]] = {
    "native": {"label": "native", "color": "#000000", "marker": "o", "markersize": 5} | _OPEN,
    "lammps": {"label": "LAMMPS", "color": "#0072B2", "marker": "s", "markersize": 9} | _OPEN,
}
"""Open markers of two sizes: where both agree, one lies inside the other."""

PROFILES: dict[str, dict[str, Any]] = {
    "cosine": {"label": "1-cosine", "color": "#0072B2", "marker": "o"},
    "triangular": {"label": "triangular", "color": "#D55E00", "marker": "s"},
    "cosine-triangular": {
        "label": "1-cosine rise, triangular decay",
        "color": "#009E73",
        "marker": "^",
    },
}
"""Colours of the three profiles of Table 1."""

RATIO_COLOURS: dict[float, str] = {
    0.3: "#440154",
    0.5: "#443983",
    0.7: "#31688e",
    1.0: "#21918c",
    1.4: "#2a9d54",
    2.0: "#6ba81f",
    2.5: "#b08a00",
}
"""Colours of the LM_ratio in Figures 3 to 5: viridis, from dark to light, with a darkened end."""


def new_figure(width: float, height: float, title: str | None = None) -> Figure:
    """Return an empty figure of a size [inches]."""
    figure = Figure(figsize=(width, height), layout="constrained", dpi=100)
    if title is not None:
        figure.suptitle(title, fontsize="medium")
    return figure
