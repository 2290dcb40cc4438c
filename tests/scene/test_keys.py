"""Keys as data, and numbers with units: read, checked and remarked as fields declare them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.scene.file import KEYS, OTHERS, SHOCKS, key_named
from hertzchain.scene.keys import _UNITS, Key, _registry, keys_of, to_si
from hertzchain.scene.scene import unusual, unusual_values
from tests.conftest import STEEL

PULSE = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)

PARTS: list[Any] = [
    hc.Chain(60, **STEEL, gap=1e-6, yield_strength=3e8),
    PULSE,
    replace(PULSE, momentum_ratio=None, rise_time=1e-5),
    hc.Striker(1.0, 5e-3, 70e9, 0.33, 2700.0),
    hc.Piston(0.1),
    hc.HalfSine(200.0, 4e-5),
    hc.Sawtooth(200.0, 4e-5),
    hc.Trapezoid(100.0, 2e-4, 2e-5, 3e-5),
    hc.Sine(5.0, 8e3, 4),
    hc.PulseTable((0.0, 1e-5, 2e-5), (0.0, 1.0, 0.0)),
    hc.Wall("elastic", 70e9, 0.33, 1e-6, 250e6),
    hc.Precompression(20.0, 9.81),
    hc.Contact("restitution", restitution=0.8),
    hc.Contact("viscoelastic", relaxation_time=2e-7),
    hc.Contact("dashpot", coefficient=5.0, attraction=True),
    hc.Run(1e-3),
    hc.Gauge(granule=5),
    hc.Gauge(contact=5),
]
"""Parts in which each key is given once."""

GIVEN = [
    (part, name, key)
    for part in PARTS
    for name, key in keys_of(type(part)).items()
    if getattr(part, name) is not None
]


def test_every_part_is_tried_and_shocks_with_a_key_of_one_name_share_it() -> None:
    of_shocks = [
        (f"{shock.section}.{name}", key) for shock in SHOCKS for name, key in keys_of(shock).items()
    ]
    tried = {type(part) for part in PARTS}
    assert {part for part in (*SHOCKS, *OTHERS.values()) if keys_of(part)} <= tried
    differing = {
        name
        for name, key in of_shocks
        if (key.unit, key.label) != (KEYS[name].unit, KEYS[name].label)
    }
    assert differing == set()


def wrong_values(key: Key) -> Iterator[object]:
    """Values that no part may have: beyond each bound, and of another type."""
    yield from ([], {}, 1j)
    if key.kind == "str":
        yield from ("square", key.choices[0].upper(), "", 3, True, ["cosine"])
        return
    yield from ("1", math.nan, math.inf, -math.inf)
    if key.kind == "bool":
        yield from (0, 1, "true")
        return
    yield from (True, np.True_, 10**400)
    step = 1 if key.kind == "int" else 0
    if key.kind == "int":
        yield from (5.0, 2.5)
    for bound, is_in, down in (
        (key.above, False, True), (key.least, True, True),
        (key.below, False, False), (key.most, True, False),
    ):  # fmt: skip
        if bound is None:
            continue
        if not is_in:
            yield bound
        outside = -math.inf if down else math.inf
        yield bound + (-step if down else step) if step else math.nextafter(bound, outside)


@pytest.mark.parametrize(("part", "name", "key"), GIVEN)
def test_an_impossible_value_is_an_error_with_key_and_value(part: Any, name: str, key: Key) -> None:
    required = next(field for field in fields(part) if field.name == name).default is not None
    for value in (*wrong_values(key), *([None] if required else [])):
        if isinstance(part, hc.Chain) and isinstance(value, list) and name != "granules":
            continue  # one number for each granule
        with pytest.raises(SceneError) as caught:
            replace(part, **{name: value})
        assert isinstance(caught.value, ValueError)
        assert caught.value.key == name
        assert caught.value.value is value
        assert caught.value.allowed == key.allowed
        assert "must be" in key.allowed
        assert not key.unit or key.allowed.endswith(f"[{key.unit}]{key.advice}")


@pytest.mark.parametrize(("part", "name", "key"), GIVEN)
def test_values_within_the_range_are_kept_as_numbers_of_python(
    part: Any, name: str, key: Key
) -> None:
    if key.kind in ("str", "bool"):
        for choice in key.choices or (True, False):
            key.check(name, choice)
        return
    edges = [edge for edge in (key.least, key.most) if edge is not None]
    edges += [] if key.above is None else [math.nextafter(key.above, math.inf)]
    edges += [] if key.below is None else [math.nextafter(key.below, -math.inf)]
    for value in edges:
        key.check(name, value)
    number = getattr(part, name)
    numpy = np.int16(number) if key.kind == "int" and number < 1000 else np.float64(number)
    assert type(getattr(replace(part, **{name: numpy}), name)) is type(number)


def test_keys_are_found_with_and_without_their_section_and_read_in_their_unit() -> None:
    assert key_named("chain.radius") is key_named("radius") is KEYS["chain.radius"]
    assert key_named("chain.segments.2.cell.1.density") is KEYS["chain.density"]
    assert key_named("segments.1.radius_ratio") is not None
    assert key_named("shock.colour") is None
    units: dict[str, set[str]] = {}
    for full, key in KEYS.items():
        units.setdefault(full.partition(".")[2], set()).add(key.unit)
    assert all(len(alike) == 1 for alike in units.values())
    assert KEYS["chain.young_modulus"].read("E", "2 GPa") == 2e9
    assert KEYS["contact.relaxation_time"].read("tau", "2 us") == pytest.approx(2e-6, rel=1e-15)
    assert KEYS["chain.granules"].read("N", "60") == "60"  # and then refused
    with pytest.raises(SceneError, match="wrong dimension"):
        KEYS["striker.velocity"].read("v", "1 N")


@pytest.mark.parametrize("name", [name for name, key in KEYS.items() if key.usual])
def test_values_beyond_the_usual_are_remarked(name: str) -> None:
    usual = KEYS[name].usual
    assert usual is not None
    low, high = usual
    assert 0 < low < high
    for value in (low, high, 0.0, [low, high], None):
        assert unusual(name, value) is None
    for value in (0.99 * low, 1.01 * high, -1.01 * high, [low, 1.01 * high]):
        said = unusual(name, value)
        assert said.startswith(f"{name} = ")
        assert said.endswith(f"(usually {low:g} to {high:g} {KEYS[name].unit})")


CHAIN = hc.Chain(3, **STEEL)


def test_unusual_values_of_every_part_are_remarked() -> None:
    table, piston = hc.PulseTable((0.0, 1e-5, 2e-5), (0.0, 1e8, 0.0)), hc.Piston(velocity=1e-6)
    for shock, remark in ((table, "peak_force = 1e+08 N"), (piston, "velocity = 1e-06 m/s")):
        assert unusual_values(hc.Scene(CHAIN, shock))[0].startswith(f"shock.{remark}")
    wall = hc.Wall("elastic", young_modulus=70.0, poisson_ratio=0.3)
    law = hc.Contact("viscoelastic", relaxation_time=2.0)
    granules = replace(CHAIN, radius=(1e-3, 1e-3, 2.5))
    remarks = unusual_values(hc.Scene(granules, hc.Striker(2000.0), wall=wall, contact=law))
    assert [remark.partition(" = ")[0] for remark in remarks] == [
        *("chain.radius", "striker.velocity", "wall.young_modulus", "contact.relaxation_time")
    ]
    assert remarks[0] == "chain.radius = 2.5 m (usually 1e-06 to 0.5 m)"


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


NUMBER = "must be a number [m] or a string such as '1 m'"
NONSENSE = [
    *("", " ", "mm", "mm 4.75", "four mm", "4,75 mm", "4.75 mm!", "4.75 furlongs_", "1_000 mm"),
    *("1 m; 2", "1 m\n2 m x", "1 + 1 m", "2 * 3 m", "1 2", "1e m s", "--1 m", "1 m/", "1 m**"),
    *("0x10 m", "1 (m", "1 m)", "$1", "1 %", "1 m m m kg", "\x00", "1 m\x00", "1,234,567 m"),
    *("None", "True", "1j", "1 + 1j", "1..2", "1 m.real", "1 m.__class__", "e", "m", "2 kg m-3"),
    *(True, None, [1.0], {"a": 1}, 1j, b"1 m", ("1", "m")),
]


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        *((value, "m", NUMBER) for value in NONSENSE),
        ("4.75 s", "m", "has the wrong dimension ([time]), must be a number [m] or a string such"),
        ("193 GN", "Pa", "[mass]"),
        ("7958 kg/m^2", "kg/m^3", "[length] ** 2"),
        ("0.3 m", "", "[length]"),
        ("1 radian", "m", "radian"),
        ("20 degC", "m", "[temperature]"),
        ("3 dBm", "m", "[length] ** 2"),
        ("193 Gpa", "Pa", "did you mean GPa?"),
        ("193 mpa", "Pa", "did you mean MPa?"),
        ("4.75 mmm", "m", "did you mean mm?"),
        ("4 MM", "m", "did you mean mm?"),  # megamolar
        ("20 kn", "N", "did you mean kN?"),  # knots
    ],
)
def test_what_is_no_quantity_is_refused(value: object, unit: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        to_si("chain.radius", value, unit)
    said = str(caught.value)
    assert (caught.value.key, caught.value.value) == ("chain.radius", value)
    assert words in said
    assert ("did you mean" in said) == ("did you mean" in words)


HOSTILE = [
    *("10**10**10 m", "__import__('os')", "1 __import__('os')", "9**9**9**9", "1 m**9**9**9**9"),
    *("1 m**(9**9**9)", "1 m**1e99", "1 m/9**9**9", "1 (((((((((((((m", "1 m**999999999"),
    *(
        "1" * 10_000 + " m",
        "1." + "1" * 10_000 + "!",
        "1 m" + " " * 10_000 + "!",
        "m*" * 5_000 + "m",
    ),
]
"""Strings on which a careless evaluation would run without end, or worse."""


@pytest.mark.parametrize("text", HOSTILE, ids=lambda text: text[:20])
def test_hostile_strings_end_quickly_with_an_error(text: str) -> None:
    with pytest.raises(SceneError) as caught:
        to_si("key", text, "m")
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize(
    ("unit", "given"), [(unit, given) for unit, usual in _UNITS.items() for given in usual]
)
@pytest.mark.parametrize("number", [1.0, 7.958e-3])
def test_usual_units_are_worth_what_pint_says(unit: str, given: str, number: float) -> None:
    by_pint = float(_registry().Quantity(number, given).to(unit).magnitude)
    # to_si gives 15 digits.
    assert to_si("key", f"{number!r} {given}", unit) == pytest.approx(by_pint, rel=2e-15, abs=0)
