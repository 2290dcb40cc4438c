"""Runs the command line: ``python -m hertzchain``."""

from hertzchain.cli import main

if __name__ == "__main__":
    main()
