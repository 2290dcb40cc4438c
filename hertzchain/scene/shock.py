"""Shocks of a chain: a force on granule 1, or granule 1 itself as striker or piston."""

from __future__ import annotations

from hertzchain.scene.piston import Piston
from hertzchain.scene.pulse import Pulse, PulseTable
from hertzchain.scene.sine import Sine
from hertzchain.scene.terms import Striker

Shock = Pulse | PulseTable | Sine | Piston | Striker
"""Any shock of a scene."""
