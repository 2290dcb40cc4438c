"""Table 3: the error of the peak forces of the transition, LM_ratio below 1, Eq. 6b."""

from __future__ import annotations

from validation.peak_forces import table_script

SCRIPT = table_script(3, "Table 3: error of the peak forces in %, LM_ratio below 1, Eq. 6b")

if __name__ == "__main__":
    SCRIPT.main()
