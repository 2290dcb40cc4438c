"""Lets a script of this folder import ``validation`` from a clone, however hertzchain is installed.

Python looks for modules next to the script that it runs, so it finds this one.
"""

from pathlib import Path

__path__ = [str(Path(__file__).resolve().parents[0])]
