"""What a sweep shows of itself."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hertzchain.report.cards import card

_MOST_VALUES = 6  # of a list that are named one by one (chosen)


def card_of(manifest: Mapping[str, Any], rows: int, folder: Path | None) -> str:
    """The card of a sweep, from its manifest alone: no table is read."""
    shock = manifest["scene"].get("shock", {})
    chain = manifest["scene"]["chain"]
    base = [f"{shock['profile']} pulse"] if shock.get("profile") else []
    base += [f"{chain['granules']:,} granules"] if "granules" in chain else []
    vary = [f"{axis['name']}: {_values(axis)}" for axis in manifest["vary"]]
    drawn = manifest["samples"]
    facts = [("scenes", ", ".join(base))] if base else []
    facts += [("varies", one) for one in vary]
    ties = manifest.get("ties", {})
    facts += [("tied", f"{key} = {formula}") for key, formula in ties.items()]
    facts += [("drawn", f"{drawn['count']:,} samples, seed {drawn['seed']}")] if drawn else []
    facts += [
        ("measured by", ", ".join(each["name"] for each in manifest["backends"])),
        ("rows", f"{rows:,} when done; count() says how many are"),
        ("kept in", "memory" if folder is None else str(folder)),
        ("peaks of all contacts", "in peaks_to_frame()" if manifest["peaks"] else "not kept"),
    ]
    return card("Sweep", facts)


def _values(axis: Mapping[str, Any]) -> str:
    """The values that a parameter takes, in SI."""
    if "values" in axis:
        values = [f"{one:.6g}" if isinstance(one, float) else str(one) for one in axis["values"]]
        more = f" and {len(values) - _MOST_VALUES} more" if len(values) > _MOST_VALUES else ""
        return ", ".join(values[:_MOST_VALUES]) + more
    count = "drawn" if axis["count"] is None else f"{axis['count']:,} values"
    by = ", by logarithms" if axis["log"] else ""
    return f"{axis['low']:.6g} to {axis['high']:.6g}, {count}{by}"
