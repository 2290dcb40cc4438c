"""The picture of a fit: what was measured, what the fitted scene gives, and residuals below.

``Fit`` shows itself by this function, which therefore does not import it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.report.picture import Picture, fit_letters, in_units

_BAND = "#56B4E9"  # Okabe and Ito's sky blue
_OF_NOISE = 2.0
"""Deviations of the noise in the band of residuals: 95 % of them are within."""


def plot_fit(fit: Any, size: tuple[float, float] | None = None) -> Picture:
    """Draw measured and fitted forces, a column for each gauge, with the residuals below."""
    count = len(fit.overlays)
    figure = Picture(size or (min(4.0 + 2.5 * count, 14.0), 5.0))
    panels = figure.subplots(
        2, count, sharex="col", sharey="row", squeeze=False, height_ratios=(2, 1)
    )
    for (above, below), one in zip(panels.T, fit.overlays, strict=True):
        order = np.argsort(one.place, kind="stable")
        place, noise = one.place[order], np.broadcast_to(one.noise, one.place.shape)[order]
        above.plot(place, one.measured[order], ".", color="0.6", markersize=2, label="measured")
        above.plot(place, one.fitted[order], color="#0072B2", linewidth=1.0, label="fitted")
        above.set_title(one.name, fontsize="medium")
        band = _OF_NOISE * noise
        below.fill_between(place, -band, band, color=_BAND, alpha=0.4, label="noise, 95 %")
        below.plot(place, (one.measured - one.fitted)[order], ".", color="0.3", markersize=2)
        in_units(below.xaxis, one.label)
    in_units(panels[0, 0].yaxis, "force [N]")
    in_units(panels[1, 0].yaxis, "residual [N]")
    panels[0, 0].legend()
    panels[1, 0].legend()
    fit_letters(figure)
    return figure
