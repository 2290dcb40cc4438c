"""What runs in the process that runs LAMMPS for another: functions in, what they return out.

Both are pickled, once more as bytes: a request that cannot be read does not spoil the next.
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
    # LAMMPS and MPI print as they like: that must not get among the answers.
    os.dup2(2, 1)
    inbox: queue.SimpleQueue[Request] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, inbox), daemon=True).start()
    while True:
        pickle.dump(_answer(inbox.get()), answers)
        answers.flush()


def _listen(requests: BinaryIO, inbox: queue.SimpleQueue[Request]) -> None:
    """Hand requests on; end the process at once when there will be no more, even while it runs."""
    try:
        while True:
            inbox.put(pickle.load(requests))  # noqa: S301 - from the process that started this one
    finally:
        os._exit(0)


def _answer(request: Request) -> bytes:
    """Whether it worked, and what came of it."""
    try:
        function, arguments = pickle.loads(request)  # noqa: S301 - as above
        return pickle.dumps((True, function(*arguments)))
    except HertzchainError as problem:
        return pickle.dumps((False, problem))
    except MemoryError:
        return pickle.dumps((False, not_enough_memory()))
    except Exception:  # a mistake in the program, to be seen where it was asked
        return pickle.dumps((False, RuntimeError(traceback.format_exc())))
