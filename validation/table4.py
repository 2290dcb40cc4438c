"""Table 4: the error of the peak forces of the transition, LM_ratio above 1, Eq. 6a."""

from __future__ import annotations

from validation.peak_forces import table_script

SCRIPT = table_script(4, "Table 4: error of the peak forces in %, LM_ratio above 1, Eq. 6a")

if __name__ == "__main__":
    SCRIPT.main()
