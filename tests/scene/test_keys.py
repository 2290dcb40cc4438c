"""Keys as data: each is checked, read and remarked as its field declares it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.scene.file import KEYS, OTHERS, SHOCKS, key_named
from hertzchain.scene.keys import Key, keys_of
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


def test_every_part_is_looked_at() -> None:
    striker = hc.Striker(velocity=2000.0)
    wall = hc.Wall("elastic", young_modulus=70.0, poisson_ratio=0.3)
    law = hc.Contact("viscoelastic", relaxation_time=2.0)
    granules = replace(CHAIN, radius=(1e-3, 1e-3, 2.5))
    remarks = unusual_values(hc.Scene(granules, striker, wall=wall, contact=law))
    assert [remark.partition(" = ")[0] for remark in remarks] == [
        *("chain.radius", "striker.velocity", "wall.young_modulus", "contact.relaxation_time")
    ]
    assert remarks[0] == "chain.radius = 2.5 m (usually 1e-06 to 0.5 m)"


@pytest.mark.parametrize(
    ("shock", "named"),
    [
        (replace(PULSE, peak_force=1e8), "shock.peak_force = 1e+08 N"),
        (hc.PulseTable((0.0, 1e-5, 2e-5), (0.0, 1e8, 0.0)), "shock.peak_force = 1e+08 N"),
        (hc.Piston(velocity=1e-6), "shock.velocity = 1e-06 m/s"),
    ],
)
def test_a_shock_is_looked_at(shock: hc.Pulse | hc.PulseTable | hc.Piston, named: str) -> None:
    (remark,) = unusual_values(hc.Scene(CHAIN, shock))
    assert remark.startswith(named)
