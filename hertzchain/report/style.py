"""How engines and formulas look in every plot: colours that the colour-blind tell apart."""

from __future__ import annotations

from hertzchain.engines.registry import ENGINES

_FORMULAS = {"eq6": ("Eq. 6", "#D55E00", "s"), "eq9": ("Eq. 9", "#009E73", "^")}

LABELS = {name: engine.label for name, engine in ENGINES.items()} | {
    name: label for name, (label, _, _) in _FORMULAS.items()
}

COLOURS = {name: engine.colour for name, engine in ENGINES.items()} | {
    name: colour for name, (_, colour, _) in _FORMULAS.items()
}
"""Okabe and Ito's."""

MARKERS = {name: engine.marker for name, engine in ENGINES.items()} | {
    name: marker for name, (_, _, marker) in _FORMULAS.items()
}
"""As Matplotlib names them."""

DASHES = {name: engine.dash for name, engine in ENGINES.items()}
"""As Plotly names them."""
