"""All shocks: one entry each, read by whatever lists or reads them."""

from __future__ import annotations

from hertzchain.scene.piston import Piston
from hertzchain.scene.pulse import Pulse, PulseTable
from hertzchain.scene.shock import Shock
from hertzchain.scene.sine import Sine
from hertzchain.scene.striker import Striker

SHOCKS: tuple[type[Shock], ...] = (Pulse, PulseTable, Striker, Piston, Sine)

OF_PROFILE = {
    name: shock for shock in SHOCKS if shock.section == "shock" for name in shock.profiles
}
"""Shocks by their names in ``profile`` of a section [shock]."""

KEYS = {name: key for shock in SHOCKS for name, key in shock.own_keys().items()}
"""Keys of all shocks; the same name has the same unit and usual range in each."""
