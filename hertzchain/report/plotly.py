"""Common parts of the plots of a page, in Plotly's format."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Trace = dict[str, Any]  # a curve in Plotly's format


@dataclass(frozen=True)
class Plot:
    """A plot of a page: its id, its description for screen readers, and its caption."""

    name: str
    label: str
    caption: str
    traces: list[Trace]
    layout: dict[str, Any]

    @property
    def figure(self) -> dict[str, Any]:
        """Return the figure for the page's script."""
        return {"data": self.traces, "layout": self.layout}


def axis(title: str, **more: Any) -> dict[str, Any]:
    """Return an axis in the style of all plots of a page."""
    style = {"showline": True, "linecolor": "#888", "ticks": "outside", "tickcolor": "#888"}
    grid = {"gridcolor": "#e4e4e4", "zeroline": False, "automargin": True}
    return {"title": {"text": title, "standoff": 8}, **style, **grid, **more}


def layout(x: dict[str, Any], y: dict[str, Any], height: int, **more: Any) -> dict[str, Any]:
    """Return the layout of a plot, with its legend below."""
    return {
        "xaxis": x,
        "yaxis": y,
        "height": height,
        "autosize": True,
        "margin": {"l": 60, "r": 14, "t": 14, "b": 50},
        "font": {"family": "system-ui, sans-serif", "size": 13, "color": "#1a1a1a"},
        "paper_bgcolor": "#fff",
        "plot_bgcolor": "#fff",
        "legend": {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom"},
        "showlegend": True,
        "hovermode": "closest",
        "hoverlabel": {"font": {"family": "system-ui, sans-serif"}},
        **more,
    }
