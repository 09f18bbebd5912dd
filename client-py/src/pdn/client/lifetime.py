"""How a Zenoh session ends, whatever ends first: the client, its last reference, the program, or a fork.

Each session has a thread of its own that closes it when told: closing can hang on a link that stands still,
a program that is at its end may start no thread (Python 3.12), and whoever waits can then be interrupted.
Nothing here keeps a program alive: all threads are daemons, and at the end of the program what is still open
is drained within `EXIT_DRAIN_S` and closed within `CLOSE_TIMEOUT_S`.

A child made by `os.fork` has none of Zenoh's threads. A session that is asked there would wait for ever, and
so would one that is merely dropped, so there it is kept and refused.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import threading
import time
import weakref
from collections.abc import Callable
from typing import Protocol, TypeVar

import zenoh

from .errors import Closed, ConnectionFailed, Forked

T = TypeVar("T")

CLOSE_TIMEOUT_S = 3.0
"""Longest wait for Zenoh to close a session, s; it can hang on a link that stands still."""

EXIT_DRAIN_S = 5.0
"""How long a program that ends waits for the events of streams that it has left open, s, all together."""


class Drained(Protocol):
    """A stream, as the end of the program sees it."""

    def drain(self, timeout_s: float) -> None:
        """Waits for what is under way, tells what remains, and stops; never raises."""


class Lifetime:
    """Whether a session may be used, and its end."""

    def __init__(self, session: zenoh.Session) -> None:
        self.streams: weakref.WeakSet[Drained] = weakref.WeakSet()
        self._process = os.getpid()
        self._session = session
        self._close = threading.Event()
        self._closer = threading.Thread(
            target=_close_when_told, args=(session, self._close), name="pdn-close", daemon=True
        )
        self._closer.start()
        self._readers: list[threading.Thread] = []
        self._lock = threading.Lock()
        # The last reference is gone: nobody can close it any more.
        weakref.finalize(self, self._close.set).atexit = False
        _OPEN.add(self)

    @property
    def closed(self) -> bool:
        """Whether it was told to close, or is another process's."""
        return self.forked or self._close.is_set()

    @property
    def forked(self) -> bool:
        """Whether this process was forked from the one that connected."""
        return self._process != os.getpid()

    def require_open(self) -> None:
        """Raises `Forked` or `Closed` where the session may not be used."""
        if self.forked:
            raise Forked(_FORKED.format(parent=self._process, child=os.getpid()))
        if self._close.is_set():
            raise Closed("The client is closed; connect again to go on.")

    def pause(self, duration_s: float) -> None:
        """Waits, but not beyond the closing."""
        self._close.wait(duration_s)

    def begin_closing(self) -> None:
        """From now on nothing new is asked; returns at once."""
        if not self.forked:
            self._close.set()

    def close(self, timeout_s: float = CLOSE_TIMEOUT_S) -> None:
        """Closes the session, or gives it up after a while; does nothing the second time."""
        if self.forked:
            return
        self._close.set()
        until_s = time.monotonic() + timeout_s
        # A thread that comes back from Zenoh while the interpreter is taken down ends the program by abort.
        with self._lock:
            threads = [self._closer, *self._readers]
        for thread in threads:
            if thread is not threading.current_thread():
                thread.join(max(0.0, until_s - time.monotonic()))

    def start_reader(self, thread: threading.Thread) -> None:
        """Starts a thread that waits in Zenoh, to be waited for at the end."""
        with self._lock:
            self._readers = [reader for reader in self._readers if reader.is_alive()]
            thread.start()
            self._readers.append(thread)

    def keep_for_ever(self) -> None:
        """Keeps the session from ever being dropped: that would wait for threads which are not here."""
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(self._session))


def bounded(call: Callable[[], T], timeout_s: float, undo: Callable[[T], object]) -> T:
    """What `call` returns or raises; waiting for it can be interrupted, and ends after a while.

    If nobody waits any more when it returns, `undo` gets the result. Raises `ConnectionFailed` at the end of
    the time.
    """
    outcome: list[T | BaseException] = []
    done, decision = threading.Event(), threading.Lock()
    abandoned = False

    def run() -> None:
        result: T | BaseException
        try:
            result = call()
        except BaseException as error:
            result = error
        with decision:
            outcome.append(result)
            unwanted = abandoned
        done.set()
        if unwanted and not isinstance(result, BaseException):
            undo(result)

    threading.Thread(target=run, name="pdn-open", daemon=True).start()
    try:
        done.wait(timeout_s)
    finally:
        with decision:
            abandoned = not done.is_set() and not outcome
    if not outcome:
        raise ConnectionFailed(
            f"Zenoh did not return within {timeout_s:g} s. If this process was forked from one that uses "
            "Zenoh, start it by the method 'spawn' instead."
        )
    if isinstance(outcome[0], BaseException):
        raise outcome[0]
    return outcome[0]


def require_unforked() -> None:
    """Raises `Forked` where no session can be opened: the process was forked after one was."""
    if _first_process is not None and _first_process != os.getpid():
        raise Forked(_FORKED.format(parent=_first_process, child=os.getpid()))


def note_opening() -> None:
    """From now on Zenoh's threads are in this process."""
    global _first_process
    _first_process = os.getpid()


_FORKED = (
    "Process {child} was forked from process {parent} after that had connected, and a fork takes none of "
    "Zenoh's threads along: nothing can be asked or sent here. Fork before the first connect, or start the "
    "child by another method: multiprocessing.get_context('spawn')."
)
_OPEN: weakref.WeakSet[Lifetime] = weakref.WeakSet()
_first_process: int | None = None


def _close_when_told(session: zenoh.Session, close: threading.Event) -> None:
    close.wait()
    session.close()  # type: ignore[no-untyped-call]


def _close_all() -> None:
    """The program ends."""
    lifetimes = [lifetime for lifetime in list(_OPEN) if not lifetime.closed]
    drain_until_s = time.monotonic() + EXIT_DRAIN_S
    for lifetime in lifetimes:
        for stream in list(lifetime.streams):
            stream.drain(max(0.0, drain_until_s - time.monotonic()))
    for lifetime in lifetimes:
        lifetime.begin_closing()
    close_until_s = time.monotonic() + CLOSE_TIMEOUT_S
    for lifetime in lifetimes:
        lifetime.close(max(0.0, close_until_s - time.monotonic()))


def _keep_all() -> None:
    """The process was forked."""
    for lifetime in list(_OPEN):
        lifetime.keep_for_ever()


atexit.register(_close_all)
os.register_at_fork(after_in_child=_keep_all)
