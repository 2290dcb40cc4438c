"""Styles of all plots: colours distinct for colour-blind readers, and markers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hertzchain.engines.registry import ENGINES

if TYPE_CHECKING:
    from matplotlib.colors import Colormap

FORMULAS = ("eq6", "eq9")  # formulas with peaks: fields of ``verdict.check.Formulas``
GIVEN = "given"  # given peaks, which belong to no engine

# Label, colour and marker of each line of a plot; those of an engine stand in its entry of the
# registry. Okabe and Ito's colours; Tol's wine for what is given.
_LOOKS = {
    **{engine.name: (engine.label, engine.colour, engine.marker) for engine in ENGINES.values()},
    "eq6": ("Eq. 6", "#D55E00", "s"),
    "eq9": ("Eq. 9", "#009E73", "^"),
    GIVEN: ("given", "#882255", "D"),
}

LABELS = {name: label for name, (label, _, _) in _LOOKS.items()}
COLOURS = {name: colour for name, (_, colour, _) in _LOOKS.items()}
MARKERS = {name: marker for name, (_, _, marker) in _LOOKS.items()}

_PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#F0E442", "#000000")


def distinct(k: int) -> str:
    """The k-th of Okabe and Ito's colours, which repeat."""
    return _PALETTE[k % len(_PALETTE)]


def force_limits(smallest: float, largest: float) -> tuple[float, float]:
    """Ends of an axis of forces [N]: from 0, or around the forces if all are far from 0."""
    # From this share of the largest force on for the smallest, an axis need not start at 0; room
    # above and below, of all that is drawn (both chosen)
    around = smallest > 0.5 * largest
    room = 0.08 * (largest - smallest if around and largest > smallest else largest)
    return (smallest - room, largest + room) if around else (0.0, largest + room or 1.0)


def force_colours() -> Colormap:
    """Return the colours of contact forces; an open contact is white."""
    from matplotlib import colormaps
    from matplotlib.colors import LinearSegmentedColormap

    darker = colormaps["magma_r"](np.linspace(0.08, 1.0, 64))
    return LinearSegmentedColormap.from_list("forces", ["white", *darker])


# Plots of a trade-off: markers and lines stand for engines.

WAYS = {
    "compiled": ("osPXDv", "-", "full"),
    "NumPy": ("p", "--", "none"),
    "SciPy": ("D", ":", "none"),
    LABELS["lammps"]: ("^<", "-.", "none"),
}
"""Markers of successive contenders, line and filling, by Matplotlib's names."""
