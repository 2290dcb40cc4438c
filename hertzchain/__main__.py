"""Runs the command line: ``hertzchain`` and ``python -m hertzchain``."""

import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    # Until ``main`` answers Ctrl-C, it ends the process without a traceback.
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from hertzchain.cli import main

if __name__ == "__main__":
    main()
