"""What is not known exactly of a scene: uncertain values of keys, and scatter among granules."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from hertzchain.errors import SceneError, is_positive, require
from hertzchain.scene.chain import MATERIAL
from hertzchain.scene.keys import Key, to_si

OF_GRANULES = tuple(f"chain.{key}" for key in (*MATERIAL, "gap", "velocity"))
"""Keys that can scatter among granules."""

SECTIONS_OF_UNCERTAIN = ("uncertainty", "scatter")

_PERCENT = re.compile(r"\s*([-+.\deE]+)\s*%\s*")
_FORM = "must be a standard deviation, such as '5 %' or one with a unit, or {half_width = ...}"


@dataclass(frozen=True)
class Uncertain:
    """How far a value may be from the one that the scene has.

    Parameters
    ----------
    key
        The key in the scene file, such as ``chain.young_modulus``.
    size
        Standard deviation of a normal distribution, or half the width of a uniform one; SI units.
    relative
        Whether ``size`` is a fraction of the value of the scene.
    uniform
        Whether the distribution is uniform.
    each
        Whether it is scatter: each granule has a value of its own, all independent.

    Raises
    ------
    SceneError
        If ``size`` is not a finite number above 0.
    """

    key: str
    size: float
    relative: bool = False
    uniform: bool = False
    each: bool = False

    def __post_init__(self) -> None:
        require(is_positive(self.size), self.key, self.size, _FORM)
        if self.each:
            require(self.key in OF_GRANULES, self.key, None, f"must be {', '.join(OF_GRANULES)}")

    @property
    def name(self) -> str:
        """The key, with a word for scatter."""
        return f"scatter of {self.key}" if self.each else self.key

    @property
    def written(self) -> Any:
        """The text of it in a scene file."""
        size = f"{100 * self.size:.15g} %" if self.relative else self.size
        return {"half_width": size} if self.uniform else size


def read_uncertain(
    section: str,
    values: Mapping[str, Any],
    key_named: Callable[[str], Key | None],
    full: Callable[[str], str],
) -> tuple[Uncertain, ...]:
    """Read [uncertainty] or [scatter]; a SceneError names the key with its section.

    ``full`` returns the full name of a key that is given without its section.
    """
    entries = []
    for given, value in _flat(values):
        name = f"{section}.{given}"
        key = f"chain.{given}" if f"chain.{given}" in OF_GRANULES else given
        try:
            key = key if section == "scatter" else full(given)
        except SceneError as problem:
            raise SceneError(name, value, problem.allowed) from None
        quantity = key_named(key)
        can_vary = quantity is not None and quantity.kind == "float" and bool(quantity.label)
        unit = quantity.unit if quantity is not None and can_vary else None
        allowed = "has no quantity; write the key as in the scene, such as chain.young_modulus"
        require("." in key and unit is not None, name, value, allowed)
        uniform = isinstance(value, dict)
        require(not uniform or list(value) == ["half_width"], name, value, _FORM)
        written = value["half_width"] if uniform else value
        percent = _PERCENT.fullmatch(written) if isinstance(written, str) else None
        try:
            size = float(percent[1]) / 100 if percent else to_si(name, written, unit or "")
            entries.append(Uncertain(key, size, percent is not None, uniform, section == "scatter"))
        except SceneError as problem:
            raise SceneError(name, value, problem.allowed) from None
        except ValueError:
            raise SceneError(name, value, _FORM) from None
    return tuple(entries)


def sections_of_uncertain(uncertain: Iterable[Uncertain]) -> dict[str, dict[str, Any]]:
    """Return the sections of a scene file, as ``read_uncertain`` reads them; none if empty."""
    sections: dict[str, dict[str, Any]] = {}
    for entry in uncertain:
        section = "scatter" if entry.each else "uncertainty"
        sections.setdefault(section, {})[entry.key] = entry.written
    return sections


def _flat(values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield keys with their values; without quotes TOML makes tables of ``chain.radius``."""
    for key, value in values.items():
        if isinstance(value, dict) and value and "half_width" not in value:
            yield from _flat(value, f"{before}{key}.")
        else:
            yield before + key, value
