"""Numbers with units, and the keys of scene files as data: unit, range, usual values and label."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from numbers import Integral, Real
from typing import TYPE_CHECKING, Annotated, Any, Literal

from hertzchain.errors import SceneError, did_you_mean, is_finite

if TYPE_CHECKING:
    import pint


Section = Mapping[str, Any]
"""Values by keys: of a section or a whole scene file, of a part of a scene, or of a manifest."""

# A number, then names with small powers, which may end in .5, multiplied and divided. Pint would
# also evaluate arithmetic, which a scene does not need and which can be made to run without end.
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:inf|nan)"
_FACTOR = r"[^\W\d_][^\W\d]*(?:\s*(?:\*\*|\^)\s*-?\d{1,2}(?:\.5)?)?"
_QUANTITY = re.compile(
    rf"\s*(?P<number>{_NUMBER})\s*(?P<unit>{_FACTOR}(?:\s*[*/]\s*{_FACTOR}|\s+{_FACTOR})*)?\s*"
)
_MOST_QUANTITY_CHARS = 80
"""Longest text of a quantity, in characters (chosen)."""


def to_si(key: str, value: object, unit: str) -> float:
    """Convert a number in SI, or a string of number and unit, to ``unit`` ("" for a pure number).

    A SceneError names the ``key`` if the value is neither, or has a unit of another dimension.
    """
    example = f"a number [{unit}] or a string such as '1 {unit}'" if unit else "a number"
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            raise SceneError(key, value, f"must be finite: {example}") from None
    short = isinstance(value, str) and len(value) <= _MOST_QUANTITY_CHARS
    match = _QUANTITY.fullmatch(value) if short and isinstance(value, str) else None
    if match is None:
        meant = _meant(value) if short and isinstance(value, str) else None
        hint = "" if meant is None else f'; did you mean "{meant}"?'
        raise SceneError(key, value, f"must be {example}{hint}")
    number = float(match["number"])
    if match["unit"] is None:
        return number
    factor = _UNITS.get(unit, {}).get(match["unit"])
    if factor is None:
        converted = _by_pint(key, value, number, match["unit"], unit, example)
    else:
        converted = number * factor
    # 8.5 g/cm^3 is 8500 kg/m^3, not 8499.999999999998; a value in SI is not changed.
    return number if converted == number else float(f"{converted:.15g}")


def _meant(value: str) -> str | None:
    """Return the quantity meant by a text with a decimal comma, or with powers without their sign.

    None for any other text.
    """
    with_point = re.sub(r"^(\s*[-+]?\d+),(\d+)", r"\1.\2", value)
    with_powers = re.sub(r"(?<=[^\W\d])(?<![eE])(\d)(?!\w)", r"^\1", with_point)
    right = with_powers != value and _QUANTITY.fullmatch(with_powers)
    return with_powers.strip() if right else None


# Pint knows these units too, but loading it takes half a second, a thousand times as long as a run.
_UNITS = {
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "nm": 1e-9},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "TPa": 1e12, "N/m^2": 1.0},
    "m/s": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "km/s": 1e3},
    "kg/m^3": {"kg/m^3": 1.0, "kg/m**3": 1.0, "g/cm^3": 1e3, "g/cm**3": 1e3},
    "N": {"N": 1.0, "kN": 1e3, "MN": 1e6, "mN": 1e-3, "uN": 1e-6, "µN": 1e-6},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
}
"""SI units, each with other units and their value in it."""


def _by_pint(key: str, value: object, number: float, given: str, unit: str, example: str) -> float:
    import pint

    registry = _registry()
    try:
        wanted = registry.Unit(unit or "dimensionless")
        return float(registry.Quantity(number, given).to(wanted).magnitude)
    except pint.DimensionalityError as problem:
        wrong = f"has the wrong dimension ({problem.dim1 or given}), must be {example}"
        alike = [name for name in _UNITS.get(unit, {}) if name.lower() == given.lower()]
        raise SceneError(key, value, wrong + did_you_mean(given, alike)) from None
    except pint.UndefinedUnitError:
        meant = did_you_mean(given, _UNITS.get(unit, {}))
        raise SceneError(key, value, f"unknown unit {given!r}, must be {example}{meant}") from None
    except Exception:
        # Pint raises many kinds of error for text that is not a unit, tokenizer errors among them.
        raise SceneError(key, value, f"cannot be understood, must be {example}") from None


@functools.cache
def _registry() -> pint.UnitRegistry[float]:
    import pint

    return pint.UnitRegistry()


@dataclass(frozen=True)
class Key:
    """A key of a section.

    Parameters
    ----------
    unit
        The SI unit; "" for a pure number.
    label
        The label on an axis, without the unit; "" for what cannot vary.
    above, least, below, most
        Bounds of the range: excluded, included, excluded, included; None for no bound.
    usual
        The range without a remark on the unit; None for no remarks.
    kind
        Type of its values.
    choices
        All possible texts.
    advice
        The end of a refusal.
    """

    unit: str = ""
    label: str = ""
    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    usual: tuple[float, float] | None = None
    kind: Literal["float", "int", "str", "bool"] = "float"
    choices: tuple[str, ...] = ()
    advice: str = ""

    @property
    def bounds(self) -> dict[str, float]:
        """The bounds that are given, by their words in messages, such as "at least"."""
        limits = {
            "above": self.above, "at least": self.least, "below": self.below, "at most": self.most,
        }  # fmt: skip
        return {words: bound for words, bound in limits.items() if bound is not None}

    @property
    def is_one_of(self) -> str:
        """The choices, as the end of a sentence; "" without choices."""
        return f"must be one of {', '.join(self.choices)}" if self.choices else ""

    @property
    def allowed(self) -> str:
        """The allowed values, as the end of a sentence."""
        if self.choices:
            return self.is_one_of
        if self.kind == "bool":
            return "must be true or false"
        kind = "a finite number"
        if self.kind == "int":
            kind = "an integer"
            if self.most:
                return f"must be an integer from {self.least} to {self.most}"
        words = " and ".join(f"{words} {bound:.15g}" for words, bound in self.bounds.items())
        of = " of" if words.startswith("at") else ""
        unit = f" [{self.unit}]" if self.unit else ""
        return f"must be {kind}{of}{words and ' '}{words}{unit}{self.advice}"

    def check(self, name: str, value: object) -> None:
        """Raise a SceneError for a value that is not allowed."""
        if not self._allows(value):  # the words take longer than the check
            raise SceneError(name, value, self.allowed)

    def _allows(self, value: Any) -> bool:
        if self.kind == "str":
            return isinstance(value, str) and value in self.choices
        if self.kind == "bool":
            return isinstance(value, bool)
        return (
            is_finite(value)
            and (self.kind == "float" or isinstance(value, Integral))
            and (self.above is None or value > self.above)
            and (self.least is None or value >= self.least)
            and (self.below is None or value < self.below)
            and (self.most is None or value <= self.most)
        )

    def read(self, name: str, value: object) -> Any:
        """Return a value of a scene file in SI; a SceneError names the key."""
        return to_si(name, value, self.unit) if self.kind == "float" else value

    @property
    def axis(self) -> str:
        """The label on an axis, with the unit."""
        unit = self.unit.replace("^3", "³").replace("^2", "²")
        return f"{self.label} [{unit}]" if unit else self.label


Positive = Annotated[float, Key(above=0)]
NotNegative = Annotated[float, Key(least=0)]
Count = Annotated[int, Key(least=1, kind="int")]
Seed = Annotated[int, Key(least=0, most=2**32 - 1, kind="int")]
"""Annotations of arguments that have a range; see ``arguments``."""


def key(*args: Any, **more: Any) -> dict[str, Key]:
    """Return the metadata of a field that is a key; for arguments see ``Key``."""
    return {"key": Key(*args, **more)}


def optional(*args: Any, **more: Any) -> Any:
    """A field that is a key, None by default; for arguments see ``Key``."""
    return field(default=None, metadata=key(*args, **more))


def alike(part: type, name: str, label: str = "") -> Any:
    """A field with the key of another part, such as a granule's for a wall; None by default."""
    return field(default=None, metadata={"key": replace(keys_of(part)[name], label=label)})


def keys_of(kind: type) -> Mapping[str, Key]:
    """The fields of a part of a scene that are keys; one with a default may be left out."""
    return {field.name: field.metadata["key"] for field in fields(kind) if field.metadata}


def check(part: Any) -> None:
    """Raise a SceneError for the first value of a frozen part that its key does not allow.

    None is allowed where it is the default, and a tuple with a value per granule is checked
    elsewhere. Numbers become Python's own, as files and decks show them.
    """
    for item in fields(part):
        value = getattr(part, item.name)
        is_each = isinstance(value, tuple) and str(item.type).startswith("PerGranule")
        is_checked = is_each or (value is None and item.default is None)
        if item.metadata and not is_checked:
            item.metadata["key"].check(item.name, value)
        if isinstance(value, Real) and not isinstance(value, bool):
            plain = int(value) if isinstance(value, Integral) else float(value)
            object.__setattr__(part, item.name, plain)
