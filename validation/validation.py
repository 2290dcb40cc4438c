"""Lets a script of this folder import ``validation`` from a clone, however hertzchain is installed.

Python looks for modules next to the script that it runs, so it finds this one. Solvers of
``tests/oracles`` are found in the clone, after all that is installed.
"""

import sys
from pathlib import Path

__path__ = [str(Path(__file__).resolve().parents[0])]
sys.path.append(str(Path(__file__).resolve().parents[1]))
