"""Run validation scripts: `python -m validation`."""

import sys

from validation.run_all import run

if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
