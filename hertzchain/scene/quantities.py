"""Numbers with units: bare numbers are SI, strings carry units ("4.75 mm")."""

from __future__ import annotations

import functools
import re
from typing import TYPE_CHECKING

from hertzchain.errors import SceneError, did_you_mean

if TYPE_CHECKING:
    import pint

# A number, then names with small powers, multiplied and divided. Pint would also evaluate
# arithmetic, which a scene does not need and which can be made to run without end.
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:inf|nan)"
_FACTOR = r"[^\W\d_][^\W\d]*(?:\s*(?:\*\*|\^)\s*-?\d{1,2})?"
_QUANTITY = re.compile(
    rf"\s*(?P<number>{_NUMBER})\s*(?P<unit>{_FACTOR}(?:\s*[*/]\s*{_FACTOR}|\s+{_FACTOR})*)?\s*"
)
_LONGEST = 80
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
    short = isinstance(value, str) and len(value) <= _LONGEST
    match = _QUANTITY.fullmatch(value) if short and isinstance(value, str) else None
    if match is None:
        meant = _meant(value) if short and isinstance(value, str) else None
        hint = "" if meant is None else f'; did you mean "{meant}"?'
        raise SceneError(key, value, f"must be {example}{hint}")
    number = float(match["number"])
    if match["unit"] is None:
        return number
    return _convert(key, value, number, match["unit"], unit, example)


def _meant(value: str) -> str | None:
    """Return the quantity meant by a text with a decimal comma, or with powers without their sign.

    None for any other text.
    """
    with_point = re.sub(r"^(\s*[-+]?\d+),(\d+)", r"\1.\2", value)
    with_powers = re.sub(r"(?<=[^\W\d])(?<![eE])(\d)(?!\w)", r"^\1", with_point)
    right = with_powers != value and _QUANTITY.fullmatch(with_powers)
    return with_powers.strip() if right else None


# Pint knows these units too, but loading it takes half a second, a thousand times as long as a run.
_USUAL = {
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "nm": 1e-9},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "TPa": 1e12, "N/m^2": 1.0},
    "kg/m^3": {"kg/m^3": 1.0, "kg/m**3": 1.0, "g/cm^3": 1e3, "g/cm**3": 1e3},
    "N": {"N": 1.0, "kN": 1e3, "MN": 1e6, "mN": 1e-3, "uN": 1e-6, "µN": 1e-6},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
}
"""SI units, each with other units and their value in it."""


def _convert(key: str, value: object, number: float, given: str, unit: str, example: str) -> float:
    factor = _USUAL.get(unit, {}).get(given)
    converted = (
        _by_pint(key, value, number, given, unit, example) if factor is None else (number * factor)
    )
    # 8.5 g/cm^3 is 8500 kg/m^3, not 8499.999999999998; a value in SI is not changed.
    return number if converted == number else float(f"{converted:.15g}")


def _by_pint(key: str, value: object, number: float, given: str, unit: str, example: str) -> float:
    import pint

    registry = _registry()
    try:
        wanted = registry.Unit(unit or "dimensionless")
        return float(registry.Quantity(number, given).to(wanted).magnitude)
    except pint.DimensionalityError as problem:
        wrong = f"has the wrong dimension ({problem.dim1 or given}), must be {example}"
        alike = [one for one in _USUAL.get(unit, {}) if one.lower() == given.lower()]
        raise SceneError(key, value, wrong + did_you_mean(given, alike)) from None
    except pint.UndefinedUnitError:
        meant = did_you_mean(given, _USUAL.get(unit, {}))
        raise SceneError(key, value, f"unknown unit {given!r}, must be {example}{meant}") from None
    except Exception:
        # Pint raises many kinds of error for text that is not a unit, tokenizer errors among them.
        raise SceneError(key, value, f"cannot be understood, must be {example}") from None


@functools.cache
def _registry() -> pint.UnitRegistry[float]:
    import pint

    return pint.UnitRegistry()
