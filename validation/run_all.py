"""The paper's tables, the known limits and planted mistakes in one go, with one summary.

``validation/tradeoff.py``, ``validation/long_run.py`` and ``validation/extremes.py``, which take
minutes, are run by themselves.
"""

from __future__ import annotations

import validation.limits
import validation.mistakes
import validation.table2
import validation.table3
import validation.table4
from validation.rows import Row, print_rows, row, run_script

SCRIPTS = (
    validation.table2,
    validation.table3,
    validation.table4,
    validation.limits,
    validation.mistakes,
)
TITLE = "Every script: rows that pass"
ALL = "every row of a script has to pass"
ENTRIES = "each of the paper's 92 entries within 0.2 percentage points"
MEAN = "percentage points; rounding to one decimal alone gives 0.025"


def compare(quick: bool = False) -> list[Row]:
    """Print each script's table; one row a script.

    Parameters
    ----------
    quick
        Run each script in its quick form.
    """
    summary, entries = [], []
    for script in SCRIPTS:
        rows = script.compare(quick)
        entries += [entry for entry in rows if ", F_" in entry.what]
        print_rows(script.TITLE, rows)
        passed = sum(entry.passed for entry in rows)
        complete = passed == len(rows)
        name = script.__name__.removeprefix("validation.")
        summary.append(Row(name, "both", passed, len(rows), 0.0, complete, ALL))
    if not quick:
        for backend in ("native", "lammps"):
            off = [abs(e.measured - e.expected) for e in entries if e.backend == backend]
            within = sum(difference <= 0.2 for difference in off)
            summary.append(row("Tables 3 and 4, entries", backend, within, 92, 0.0, ENTRIES))
            mean = sum(off) / len(off) if off else float("nan")
            summary.append(row("Tables 3 and 4, mean", backend, mean, 0.0, 0.05, MEAN))
    return summary


def main() -> None:
    """Print every table and the summary; exit 1 when a row is off."""
    run_script(TITLE, compare)


if __name__ == "__main__":
    main()
