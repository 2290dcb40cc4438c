"""Balances of a run: momentum, energy, and the digits lost to coordinates."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Balance:
    """Momentum and energy given to the chain, and those that it has at the end of a run.

    Parameters
    ----------
    impulse
        Integral of the applied force over time, from the scene [N s]; with a striker its momentum,
        with a piston the integral of its force on granule 2, with constant forces their impulse,
        less that on a wall.
    momentum
        Momentum of all granules except a piston at the end [N s].
    work
        Work of the applied force, or of a piston on granule 2, plus the energy at the start [J].
    energy
        Energy at the end [J]: kinetic energy of all granules except a piston, plus 2/5 F overlap
        for each contact, less the work of constant forces.
    dissipated
        Energy that damping of contacts took [J].
    """

    impulse: float
    momentum: float
    work: float
    energy: float
    dissipated: float = 0.0


@dataclass(frozen=True)
class LostDigits:
    """Digits that a code loses to absolute coordinates, and the modulus used to limit the loss.

    Parameters
    ----------
    young_modulus
        Modulus passed to the code [Pa]: the scene's own, or that of a similar scene which loses
        fewer digits and whose results are scaled back.
    predicted
        Relative error of the peaks with the scene's own modulus, estimated before the run.
    bound
        Upper bound of the relative error of the peaks with the modulus used; part of the error
        estimate.
    """

    young_modulus: float
    predicted: float
    bound: float
