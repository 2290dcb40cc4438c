"""Long pulses in damped chains: trains of waves, and the front of a constant force.

A constant force F0 sends a front that presses contacts with F0 behind it. Momentum and overlap give
its speed, F0^(1/6) granules per time unit where stiffness and mass are 1, and energy says that
damping takes a tenth of the work, whatever the law and its coefficient.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure

import hertzchain as hc
from validation.physics.chains import steel
from validation.script import Row, Script, new_figure, row
from validation.shipped import history_of

FORCE = 100.0
"""Of every pulse [N]."""

DAMPING: dict[str, tuple[hc.Contact | None, str]] = {
    "no damping": (None, "#444444"),
    "e = 0.99": (hc.Contact("restitution", restitution=0.99), "#0072B2"),
    "e = 0.9": (hc.Contact("restitution", restitution=0.9), "#21918c"),
    "e = 0.5": (hc.Contact("restitution", restitution=0.5), "#b08a00"),
}
"""Laws and colours of the histories."""

FRONTS: dict[str, hc.Contact] = {
    "restitution 0.9": hc.Contact("restitution", restitution=0.9),
    "restitution 0.8": hc.Contact("restitution", restitution=0.8),
    "restitution 0.5": hc.Contact("restitution", restitution=0.5),
    "dashpot 20 kg/s": hc.Contact("dashpot", coefficient=20.0),
    "viscoelastic 2 us": hc.Contact("viscoelastic", relaxation_time=2e-6),
}
"""Laws whose fronts are steady after 150 granules."""

_CONTACTS = (5, 20, 60)
"""Indices of the contacts whose force is drawn."""

_GRANULES = 240

_STEADY = "the front grows towards a steady one; 2e-5 at most measured"
_DRAWN = 4
"""Digits of the histories that are kept."""


def measure(quick: bool, _: bool) -> pandas.DataFrame:
    """Histories of a long pulse, and fronts of a constant force; the quick form has fewer.

    Of histories ``x`` is the time in natural units, ``y`` the force over F0; of fronts ``x`` is the
    speed over F0^(1/6), ``y`` the share of the work that damping takes.
    """
    rows: list[dict[str, Any]] = []
    for label, (contact, _colour) in DAMPING.items():
        if not quick or contact is not None:
            rows += train(label, contact)
    for label, law in list(FRONTS.items())[: 1 if quick else None]:
        speed, share, highest = front(law)
        rows.append({"kind": "front", "law": label, "contact": 0, "x": speed, "y": share})
        rows.append({"kind": "highest", "law": label, "contact": 190, "x": 0.0, "y": highest})
    return pandas.DataFrame(rows)


def train(label: str, contact: hc.Contact | None) -> list[dict[str, Any]]:
    """Forces over time in three contacts, under a pulse of LM_ratio 10."""
    pulse = hc.Pulse("cosine-triangular", FORCE, 2.0, momentum_ratio=10.0)
    scene = hc.Scene(steel(100), pulse, contact=contact)
    unit = scene.units.time
    time = np.linspace(0.0, 120.0, 401)
    scene = hc.Scene(steel(100), pulse, hc.Run(120.5 * unit), contact=contact)
    force = history_of(hc.Native(rtol=1e-6).run(scene, time * unit)).contact_force / FORCE
    return [
        {"kind": "history", "law": label, "contact": k + 2, "x": t, "y": round(f, _DRAWN)}
        for k in _CONTACTS
        for t, f in zip(time.tolist(), force[:, k].tolist(), strict=True)
    ]


def front(contact: hc.Contact) -> tuple[float, float, float]:
    """Speed of the front of a constant force, the share that damping takes, and its highest force.

    Between two times the front has passed from about contact 160 to 200.
    """
    results = []
    chain = steel(_GRANULES)
    unit = hc.Scene(chain, hc.PulseTable((0.0, 1.0), (FORCE, FORCE))).units.time
    end = 210.0 * unit
    pulse = hc.PulseTable((0.0, 2 * end), (FORCE, FORCE))
    for stop in (170.0 * unit, end):
        scene = hc.Scene(chain, pulse, hc.Run(stop), contact=contact)
        results.append(hc.Native(rtol=1e-9).run(scene))
    before, after = (result.balance for result in results)
    share = (after.dissipated - before.dissipated) / (after.work - before.work)
    time = np.linspace(130.0, 209.0, 4001)
    force = history_of(hc.Native(rtol=1e-9).run(scene, time * unit)).contact_force
    # The front arrives where the force first is half of F0.
    arrived = [float(np.interp(0.5 * FORCE, *_rise(force[:, k], time))) for k in (140, 190)]
    speed = 50 / (arrived[1] - arrived[0])
    return speed, share, float(results[1].peak_force[190]) / FORCE


def _rise(force: Any, time: Any) -> tuple[Any, Any]:
    """Force and time up to the first maximum beyond half of F0."""
    half = int(np.argmax(force > 0.5 * FORCE))
    return force[half - 1 : half + 1], time[half - 1 : half + 1]


def promises(table: pandas.DataFrame) -> list[Row]:
    """Speed and losses of fronts."""
    rows = []
    fronts = table[table["kind"] == "front"]
    for law, speed, share in zip(fronts["law"], fronts["x"], fronts["y"], strict=True):
        what = f"constant force, {law}: speed / F0^(1/6)"
        rows.append(row(what, "native", speed, 1.0, 1e-4, _STEADY))
        what = f"constant force, {law}: dissipated / work"
        rows.append(row(what, "native", share, 0.1, 1e-4, _STEADY))
    return rows


def draw(table: pandas.DataFrame) -> Figure:
    """The force in three contacts over time."""
    figure = new_figure(10, 6)
    axes = figure.subplots(len(_CONTACTS), 1, sharex=True)
    histories = table[table["kind"] == "history"]
    for axis, contact in zip(axes, _CONTACTS, strict=True):
        for law, (_, colour) in DAMPING.items():
            some = histories[(histories["law"] == law) & (histories["contact"] == contact + 2)]
            if len(some):
                axis.plot(some["x"], some["y"], color=colour, linewidth=1.2, label=law)
        axis.set_ylabel(f"F / F0, contact {contact + 2}")
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize="small")
    axes[-1].set_xlabel("time, natural units")
    return figure


SCRIPTS = {
    "damped_pulses": Script(
        "Long pulses in damped chains",
        "Does the front of a constant force have the speed and the loss that balances give?",
        measure, promises, draw,
    )
}  # fmt: skip
