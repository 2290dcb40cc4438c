"""Code of the child process for LAMMPS: it receives functions and returns their results.

Both are pickled twice, the second time as bytes: an unreadable request does not affect the next.
"""

from __future__ import annotations

import os
import pickle
import queue
import threading
import traceback
from typing import BinaryIO

from hertzchain.engines.lammps.dialect import not_enough_memory
from hertzchain.errors import HertzchainError

Request = bytes


def serve() -> None:
    """Answer requests from standard input until the process that asks is gone."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # Output of LAMMPS and MPI must not mix with the answers.
    os.dup2(2, 1)
    inbox: queue.SimpleQueue[Request] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, inbox), daemon=True).start()
    while True:
        pickle.dump(_answer(inbox.get()), answers)
        answers.flush()


def _listen(requests: BinaryIO, inbox: queue.SimpleQueue[Request]) -> None:
    """Queue requests; at their end, stop the process at once, even during a run."""
    try:
        while True:
            inbox.put(pickle.load(requests))  # noqa: S301 - from the process that started this one
    finally:
        os._exit(0)


def _answer(request: Request) -> bytes:
    """Return whether a request worked, and its result or error."""
    try:
        function, arguments = pickle.loads(request)  # noqa: S301 - as above
        return pickle.dumps((True, function(*arguments)))
    except HertzchainError as problem:
        return pickle.dumps((False, problem))
    except MemoryError:
        return pickle.dumps((False, not_enough_memory("this chain")))
    except Exception:  # a bug, raised again in the process that asked
        return pickle.dumps((False, RuntimeError(traceback.format_exc())))
