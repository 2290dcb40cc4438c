"""The picture of a fit: what was measured, what the fitted scene gives, and residuals below.

``Fit`` shows itself by this function, which therefore does not import it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.report.picture import Picture, fit_letters, in_units


def plot_fit(fit: Any, size: tuple[float, float] | None = None) -> Picture:
    """Draw measured and fitted forces, a column for each gauge, with the residuals below."""
    count = len(fit.overlays)
    figure = Picture(size or (min(4.0 + 2.5 * count, 14.0), 5.0))
    panels = figure.subplots(
        2, count, sharex="col", sharey="row", squeeze=False, height_ratios=(2, 1)
    )
    for (above, below), one in zip(panels.T, fit.overlays, strict=True):
        order = np.argsort(one.time, kind="stable")
        place, measured, fitted = (x[order] for x in (one.time, one.measured, one.expected))
        above.plot(place, measured, ".", color="0.6", markersize=2, label="measured")
        above.plot(place, fitted, color="#0072B2", linewidth=1.0, label="fitted")
        above.set_title(one.label, fontsize="medium")
        below.plot(place, measured - fitted, ".", color="0.3", markersize=2)
        in_units(below.xaxis, "time [s]" if fit.noise_is_known else "contact")
    in_units(panels[0, 0].yaxis, "force [N]")
    in_units(panels[1, 0].yaxis, "residual [N]")
    panels[0, 0].legend()
    fit_letters(figure)
    return figure
