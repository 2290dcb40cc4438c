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

from hertzchain.scene.arguments import checked
from hertzchain.theory import peak_map as peak_map
from hertzchain.theory import restitution as restitution
from hertzchain.theory import solitary_wave as solitary_wave
from hertzchain.theory.paper import acceleration as acceleration
from hertzchain.theory.paper import applied_force as applied_force
from hertzchain.theory.paper import applied_momentum as applied_momentum
from hertzchain.theory.paper import contact_force as contact_force
from hertzchain.theory.paper import effective_momentum_ratio as effective_momentum_ratio
from hertzchain.theory.paper import ejection_momentum as ejection_momentum
from hertzchain.theory.paper import granule_velocity as granule_velocity
from hertzchain.theory.paper import momentum_ratio as momentum_ratio
from hertzchain.theory.paper import normalized_contact as normalized_contact
from hertzchain.theory.paper import normalized_peak_force as normalized_peak_force
from hertzchain.theory.paper import outside_range as outside_range
from hertzchain.theory.paper import passed_momentum as passed_momentum
from hertzchain.theory.paper import peak_force as peak_force
from hertzchain.theory.paper import peak_force_cubic as peak_force_cubic
from hertzchain.theory.paper import peak_force_fit as peak_force_fit
from hertzchain.theory.paper import peak_shift as peak_shift
from hertzchain.theory.paper import solitary_wave_momentum as solitary_wave_momentum
from hertzchain.theory.paper import solitary_wave_speed as solitary_wave_speed
from hertzchain.theory.paper import transition_granules as transition_granules
from hertzchain.theory.paper import unit_rise_time as unit_rise_time
from hertzchain.theory.paper import wave_momentum as wave_momentum
from hertzchain.theory.paper import wave_profile as wave_profile
from hertzchain.theory.prediction import Prediction as Prediction
from hertzchain.theory.prediction import predict as predict

_INNER = ("checked", "paper", "prediction", "sys")
__all__ = sorted(name for name in vars() if name[0].isalpha() and name not in _INNER)  # noqa: PLE0605

for _module in (sys.modules[__name__], peak_map, restitution, solitary_wave):
    for _name, _public in list(vars(_module).items()):
        if getattr(_public, "__module__", "").startswith(__name__) and not _name.startswith("_"):
            setattr(_module, _name, checked(_public))
