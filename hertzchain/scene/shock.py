"""What can shock a chain: a force on granule 1, or granule 1 itself."""

from __future__ import annotations

from hertzchain.scene.piston import Piston
from hertzchain.scene.pulse import Pulse, PulseTable
from hertzchain.scene.sine import Sine
from hertzchain.scene.terms import Striker

Shock = Pulse | PulseTable | Sine | Piston | Striker
"""The shock of a scene."""
