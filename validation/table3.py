"""Table 3: the error of the peak forces of the transition, LM_ratio below 1, Eq. 6b."""

from __future__ import annotations

from validation.peak_forces import compare_table
from validation.rows import Row, run_script

TITLE = "Table 3: error of the peak forces in %, LM_ratio below 1, Eq. 6b"


def compare(quick: bool = False) -> list[Row]:
    """Error of Eq. 6 for each entry of Table 3, with both backends.

    Parameters
    ----------
    quick
        Take one scene of each profile instead of three.
    """
    return compare_table(3, quick)


def main() -> None:
    """Print the table; exit 1 when a row is off."""
    run_script(TITLE, compare)


if __name__ == "__main__":
    main()
