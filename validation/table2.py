"""Table 2: the number p of granules in the transition, simulated and by Eqs. 3a and 3b."""

from __future__ import annotations

import hertzchain as hc
from hertzchain import theory
from validation.rows import Row, did_not_run, paper_table, row, run_script, scene_name, simulate

TITLE = "Table 2: granules in the transition, p"

EXACT = "p is a whole number"
PRINTED = "the paper prints one decimal: equal after rounding, or off by at most 0.05"


def compare(quick: bool = False) -> list[Row]:
    """Simulated p and p of Eq. 3 for each scene of Table 2, with both backends.

    Parameters
    ----------
    quick
        Take one scene of each profile instead of two.
    """
    entries = paper_table(2)
    entries = entries[::2] if quick else entries
    results = simulate([scene_name(entry) for entry in entries], TITLE)
    rows = []
    for entry in entries:
        name = scene_name(entry)
        for backend in ("native", "lammps"):
            result = results[name, backend]
            if isinstance(result, hc.HertzchainError):
                rows.append(did_not_run(name, backend, result))
                continue
            p = result.transition_granules
            measured = float("nan") if p is None else float(p)
            expected = float(entry["p_numerical"])
            rows.append(row(f"{name}, p simulated", backend, measured, expected, 0.0, EXACT))
            rows.append(_analytic(name, result, float(entry["p_analytic"])))
    return rows


def _analytic(name: str, result: hc.Result, printed: float) -> Row:
    scene, wave_force = result.scene, result.solitary_wave.peak_force
    assert isinstance(scene.shock, hc.Pulse)
    assert scene.rise_time is not None
    p = (
        float("nan")
        if wave_force is None
        else theory.transition_granules(scene.chain, scene.shock, scene.rise_time, wave_force)
    )
    passed = round(p, 1) == printed or abs(p - printed) <= 0.05
    return Row(f"{name}, p by Eq. 3", result.backend, p, printed, 0.05, passed, PRINTED)


def main() -> None:
    """Print the table; exit 1 when a row is off."""
    run_script(TITLE, compare)


if __name__ == "__main__":
    main()
