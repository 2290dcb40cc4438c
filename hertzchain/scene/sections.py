"""The values of a scene by the sections and keys of its file, for JSON and TOML."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from hertzchain.scene.parts import OTHERS
from hertzchain.scene.shock import Shock
from hertzchain.scene.tables import columns_of
from hertzchain.scene.uncertain import sections_of_uncertain


def sections_of(scene: Any, defaults: bool = True) -> dict[str, Any]:
    """A scene as its file has it, in SI: a JSON object for each section, each a key for a value.

    Values that are not given are left out. Tables stand in the sections by their columns: those of
    a pulse or a piston as ``time_s`` and ``force_N`` or ``displacement_m``, those of unlike
    granules as lists with one number for each, or as the segments of the scene file. Without
    ``defaults`` these are left out, and segments, too.
    """
    chain, shock = scene.chain, scene.shock
    sections: dict[str, Any] = {
        "chain": _given(chain, defaults)
        if chain.section is None or not defaults
        else {**chain.section},
        shock.section: _of_shock(shock, defaults),
        **{name: _given(getattr(scene, name), defaults) for name in OTHERS},
        "gauge": [_given(gauge, defaults) for gauge in scene.gauges],
        **sections_of_uncertain(scene.uncertain),
    }
    absent = (
        (("chain", "gap"), 0),
        (("chain", "velocity"), 0),
        (("wall", "gap"), 0),
        (("near_wall", "gap"), 0),
        (("chain", "fixed"), False),
    )
    for (section, key), value in (*absent, ((shock.section, "granule"), 1)):
        if sections[section].get(key) == value:
            del sections[section][key]
    return {name: section for name, section in sections.items() if section}


def _of_shock(shock: Shock, defaults: bool) -> dict[str, Any]:
    """The section of a shock; a table stands in it by its columns."""
    values = {} if shock.section != "shock" else {"profile": shock.profile_name}
    columns = {name: list(column) for name, column in columns_of(shock).items()}
    if not columns:
        return values | _given(shock, defaults)
    more = {} if shock.granule == 1 else {"granule": shock.granule}
    return {**values, **more, **columns}


def _given(part: Any, defaults: bool) -> dict[str, Any]:
    """The fields of a frozen object that are given, without None and perhaps without defaults."""
    known = () if part is None else fields(part)
    values = {one.name: (getattr(part, one.name), one.default) for one in known}
    return {
        key: list(value) if isinstance(value, tuple) else value
        for key, (value, default) in values.items()
        if value is not None and key != "file" and (defaults or value != default)
    }
