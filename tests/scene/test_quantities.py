"""Numbers with units: understood ones, and harmless refusals of all other text."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hertzchain.errors import SceneError
from hertzchain.scene.keys import _UNITS, _registry, to_si
from tests.effort import effort


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("4.75 mm", "m", 4.75e-3),
        ("193 GPa", "Pa", 193e9),
        ("193e9 N/m^2", "Pa", 193e9),
        ("7958 kg/m^3", "kg/m^3", 7958.0),
        ("7.958 g/cm**3", "kg/m^3", 7958.0),
        ("100 N", "N", 100.0),
        ("70 us", "s", 70e-6),
        ("70 µs", "s", 70e-6),  # micro sign
        ("70 μs", "s", 70e-6),  # Greek mu
        ("20 ns", "s", 20e-9),
        ("  20   ns ", "s", 20e-9),
        ("20\u00a0ns", "s", 20e-9),  # no-break space
        ("2e1 ns", "s", 20e-9),
        ("+.2E+2 ns", "s", 20e-9),
        ("1 in", "m", 0.0254),
        ("1 millimeter", "m", 1e-3),
        ("1 minute", "s", 60.0),
        ("-3 m", "m", -3.0),
        ("50 mm/m", "", 0.05),
    ],
)
def test_a_string_with_a_unit_is_converted(text: str, unit: str, expected: float) -> None:
    # A factor or two, each rounded to 1e-16.
    assert to_si("key", text, unit) == pytest.approx(expected, rel=1e-15)


@given(st.floats(allow_nan=False))
def test_numbers_pass_unchanged(number: float) -> None:
    assert to_si("key", number, "m") == number
    assert to_si("key", repr(number), "m") == number
    assert to_si("key", f"{number!r} m", "m") == number
    assert math.isnan(to_si("key", "nan m", "m"))


@pytest.mark.parametrize(
    ("text", "unit", "dimension"),
    [
        ("4.75 s", "m", "[time]"),
        ("193 GN", "Pa", "[mass]"),
        ("7958 kg/m^2", "kg/m^3", "[length] ** 2"),
        ("100 mm", "N", "[length]"),
        ("0.3 m", "", "[length]"),
        ("1 radian", "m", "radian"),
        ("20 degC", "m", "[temperature]"),
        ("3 dBm", "m", "[length] ** 2"),
    ],
)
def test_a_wrong_dimension_is_an_error_that_names_it(text: str, unit: str, dimension: str) -> None:
    with pytest.raises(SceneError, match="has the wrong dimension") as caught:
        to_si("chain.radius", text, unit)
    assert (caught.value.key, caught.value.value) == ("chain.radius", text)
    assert dimension in str(caught.value)
    if unit:
        assert f"'1 {unit}'" in str(caught.value)


@pytest.mark.parametrize(
    "value",
    [
        *("", " ", "mm", "mm 4.75", "four mm", "4,75 mm", "4.75 mm!", "4.75 furlongs_", "4.75 mmm"),
        *("1 m; 2", "1 m\n2 m x", "1 + 1 m", "2 * 3 m", "1 2", "1e m s", "--1 m", "1 m/", "1 m**"),
        *("0x10 m", "1_000 mm", "1 (m", "1 m)", "$1", "1 %", "1 m m m kg", "\x00", "1 m\x00"),
        *("None", "True", "1j", "1 + 1j", "1..2", "1 m.real", "1 m.__class__", "e", "m"),
    ],
)
def test_nonsense_is_an_error(value: str) -> None:
    with pytest.raises(SceneError, match="must be a number \\[m\\] or a string such as '1 m'"):
        to_si("key", value, "m")


HOSTILE = [
    *("10**10**10 m", "__import__('os')", "1e999 m", "1 __import__('os')", "9**9**9**9"),
    *("1 m**9**9**9", "1 m^9^9^9^9", "1 m**(9**9**9)", "1 m**9**9**9**9**9**9", "1 m**-9**9**9"),
    *("1 m**99**99**99", "1 m**1e99", "1 m**9e9", "1 m/9**9**9", "1 m**999999999", "1 m*9**9**9"),
    *("1 (((((((((((((m", "1 m" + "*m" * 20, "1 m" + " m" * 18, "1 " + "(" * 19 + "m" + ")" * 19),
    *("1" * 10_000, "1" * 10_000 + "!", "1" * 10_000 + " m", "1." + "1" * 10_000 + "!"),
    *("1" + " " * 10_000 + "!", "1 m" + " " * 10_000 + "!", " " * 10_000, "1 " + "m" * 10_000),
    *("1 m**" + "9" * 10_000, "1e" + "9" * 10_000 + " m", "(" * 10_000, "m" * 10_000),
    *("1 " + "m*" * 5_000 + "m", "-" * 10_000 + "1 m", "+1e+" * 2_500, "1 " + "_" * 10_000),
]
"""Strings on which a careless evaluation would run without end, or worse."""


@pytest.mark.parametrize("text", HOSTILE, ids=lambda text: text[:20])
def test_hostile_strings_end_quickly_with_an_error(text: str) -> None:
    to_si("key", "1e-4 furlong", "m")  # the units are loaded

    ends: list[object] = []

    def read() -> None:
        try:
            ends.append(to_si("key", text, "m"))
        except SceneError as problem:
            ends.append(problem)

    # Measured: at most 14, for 5,000 factors; a careless evaluation would run without end.
    assert effort(read) < 200
    # The caller refuses an infinite number.
    assert ends == [math.inf] or (isinstance(ends[0], SceneError) and len(str(ends[0])) < 500)


@pytest.mark.parametrize(
    ("unit", "given"), [(unit, given) for unit, usual in _UNITS.items() for given in usual]
)
@pytest.mark.parametrize("number", [1.0, 7.958e-3])
def test_usual_units_are_worth_what_pint_says(unit: str, given: str, number: float) -> None:
    by_pint = float(_registry().Quantity(number, given).to(unit).magnitude)
    # to_si gives 15 digits.
    assert to_si("key", f"{number!r} {given}", unit) == pytest.approx(by_pint, rel=2e-15, abs=0)


@pytest.mark.parametrize(
    ("text", "unit", "meant"),
    [
        ("193 Gpa", "Pa", "GPa"),
        ("193 mpa", "Pa", "MPa"),
        ("4 MM", "m", "mm"),  # megamolar
        ("20 kn", "N", "kN"),  # knots
        ("4,75 mm", "m", '"4.75 mm"'),
        ("7.9 g/cm3", "kg/m^3", '"7.9 g/cm^3"'),
        ("7,9 g/cm3", "kg/m^3", '"7.9 g/cm^3"'),
        (" -3 N/m2", "Pa", '"-3 N/m^2"'),
        *((text, "m", "") for text in ("1,234,567 m", "four mm", "1 m2x", "2 kg m-3", "5 N")),
    ],
)
def test_what_looks_like_another_unit_has_a_hint(text: str, unit: str, meant: str) -> None:
    hint = rf"; did you mean {re.escape(meant)}\?" if meant else f" or a string such as '1 {unit}'"
    with pytest.raises(SceneError, match=f"{hint}$"):
        to_si("key", text, unit)


@pytest.mark.parametrize("value", [True, False, None, [1.0], {"a": 1}, 1j, b"1 m", ("1", "m")])
def test_what_is_no_number_and_no_string_is_an_error(value: object) -> None:
    with pytest.raises(SceneError, match="must be"):
        to_si("key", value, "m")
