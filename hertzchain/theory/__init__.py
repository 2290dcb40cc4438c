"""Closed formulas.

======================= ==========================================================================
Eq. 1                   acceleration
Eq. 2, Table 1          applied_force; also hertzchain.scene.shocks, which the simulations use
L_Applied, L_SW, LM     applied_momentum, solitary_wave_momentum, unit_rise_time, momentum_ratio
V_SW                    solitary_wave_speed
Eqs. 3a, 3b             transition_granules
Delta L                 ejection_momentum
Eqs. 4a, 4b; S          contact_force, peak_shift; wave_profile
Eq. 5                   wave_momentum, passed_momentum
Eqs. 6a, 6b             peak_force with effective_momentum_ratio
Eqs. 7a, 7b, 8, 9       normalized_contact, normalized_peak_force, peak_force_fit, peak_force_cubic
section 5.1             granule_velocity
======================= ==========================================================================

outside_range says why the paper's own formulas do not hold for a scene. Beyond the paper:
hertzchain.theory.solitary_wave has the exact solitary wave, hertzchain.theory.peak_map peaks
without a simulation, hertzchain.theory.restitution coefficients of restitution of damped contacts;
predict returns all of these results for a scene.
"""

import sys

from hertzchain.scene.keys import checked
from hertzchain.theory import paper
from hertzchain.theory import peak_map as peak_map
from hertzchain.theory import restitution as restitution
from hertzchain.theory import solitary_wave as solitary_wave
from hertzchain.theory.paper import *  # noqa: F403 - its functions are public here
from hertzchain.theory.prediction import Prediction as Prediction
from hertzchain.theory.prediction import predict as predict

_NAMES = "Prediction peak_map predict restitution solitary_wave"
__all__ = sorted([*_NAMES.split(), *paper.__all__])  # noqa: PLE0605

for _module in (sys.modules[__name__], peak_map, restitution, solitary_wave):
    for _name, _public in list(vars(_module).items()):
        if getattr(_public, "__module__", "").startswith(__name__) and not _name.startswith("_"):
            setattr(_module, _name, checked(_public))
