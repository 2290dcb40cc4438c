"""Every validation script in one go, with one summary."""

from __future__ import annotations

import validation.table2
import validation.table3
import validation.table4
from validation.rows import Row, print_rows, run_script

SCRIPTS = (validation.table2, validation.table3, validation.table4)
TITLE = "Every script: rows that pass"
ALL = "every row of a script has to pass"


def compare(quick: bool = False) -> list[Row]:
    """Print each script's table; one row a script.

    Parameters
    ----------
    quick
        Run each script in its quick form.
    """
    summary = []
    for script in SCRIPTS:
        rows = script.compare(quick)
        print_rows(script.TITLE, rows)
        passed = sum(entry.passed for entry in rows)
        complete = passed == len(rows)
        name = script.__name__.removeprefix("validation.")
        summary.append(Row(name, "both", passed, len(rows), 0.0, complete, ALL))
    return summary


def main() -> None:
    """Print every table and the summary; exit 1 when a row is off."""
    run_script(TITLE, compare)


if __name__ == "__main__":
    main()
