"""A child process of the daemon: started with spawn, ended by a word, revived if it may be."""

import contextlib
import importlib
import os
import signal
import sys
import time
from collections.abc import Callable
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import TextIO

from pneuarm.service.processes.last_resort import sentence
from pneuarm.service.processes.usage import ProcessTable

#: A dead process is started again this long after its last start, and twice as long each time
#: that it died soon again: below the 30 s that the rings hold for a recorder.
_REVIVE_AFTER_S = 1.0
_LONGEST_WAIT_S = 16.0
_LIVED_S = 5.0

#: How often somebody who ends a process looks how far it is.
_LOOK_S = 0.5


def enter(name: str, module: str, arguments: tuple[object, ...]) -> None:
    """Run a process's own `main`; this is what the new interpreter starts with."""
    try:
        main: Callable[..., None] = importlib.import_module(module).main
        main(*arguments)
    except SystemExit as ending:  # whoever raises it has told why
        os._exit(ending.code if isinstance(ending.code, int) else 1)
    except BaseException as error:
        _print(f"ERROR      {name}: {sentence(error)}", sys.stderr)
        os._exit(1)  # a library's threads might keep the process from ending
    _print("", sys.stdout, end="")
    os._exit(0)  # nothing is left to do, and the garbage of a frozen heap is nobody's business


def _print(text: str, stream: TextIO | None, end: str = "\n") -> None:
    """Print, where somebody still listens."""
    with contextlib.suppress(OSError):
        print(text, end=end, file=stream or sys.stdout, flush=True)


class Child:
    """One process. The last argument of its `main` is a connection that says when to end.

    Its module is loaded in the child only, so that the parent stays small.
    """

    def __init__(
        self,
        name: str,
        module: str,
        context: SpawnContext,
        arguments: tuple[object, ...],
        table: ProcessTable,
    ) -> None:
        self.name, self._module = name, module
        self._context, self._arguments, self._table = context, arguments, table
        self._process: SpawnProcess | None = None
        self._end: Connection | None = None
        self._restarts = 0
        self._started_s = 0.0
        self._alive_s = 0.0
        self._wait_s = _REVIVE_AFTER_S

    def start(self) -> None:
        """Start it, or start it again."""
        theirs, self._end = self._context.Pipe(duplex=False)
        arguments = (self.name, self._module, (*self._arguments, theirs))
        self._process = self._context.Process(target=enter, args=arguments, name=self.name)
        self._start_unheard(self._process)
        theirs.close()
        self._started_s = time.monotonic()
        self._table.started(self.name, self._process.pid or 0, self._restarts)

    @staticmethod
    def _start_unheard(process: SpawnProcess) -> None:
        """Start with the terminal's signals blocked: who still imports cannot ignore them yet."""
        resource_tracker.ensure_running()  # its own start would unblock them
        before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGHUP))
        try:
            process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def is_alive(self) -> bool:
        """Whether it runs (or is stopped, which only its silence tells)."""
        return self._process is not None and self._process.is_alive()

    def revive_if_due(self) -> bool:
        """Start it again if it is dead, and dead for long enough; return whether it was."""
        now_s = time.monotonic()
        if self.is_alive():
            self._alive_s = now_s
            return False
        if self._alive_s - self._started_s > _LIVED_S:
            self._wait_s = _REVIVE_AFTER_S
        if now_s - self._started_s < self._wait_s:
            return False
        self._wait_s = min(2.0 * self._wait_s, _LONGEST_WAIT_S)
        self._restarts += 1
        self.start()
        return True

    def end_if_loading(self) -> None:
        """End it at once if it still loads its modules; after that it ignores this signal."""
        if self._process is not None:
            self._process.terminate()

    def end(self, patience_s: float, progress: Callable[[], object] = lambda: None) -> bool:
        """Ask it to end; kill it after the given time. Return whether it ended by itself.

        The time begins anew whenever ``progress``, which says how far it is, says something else.
        """
        if self._end is not None:
            self._end.close()  # the child reads the end of this pipe as the word
        reached, since_s = progress(), time.monotonic()
        while not self.join(min(_LOOK_S, patience_s)):
            now, now_s = progress(), time.monotonic()
            if now != reached:
                reached, since_s = now, now_s
            elif now_s - since_s > patience_s:
                self.kill()
                return False
        return True

    def join(self, patience_s: float) -> bool:
        """Wait for its end; return whether it came."""
        if self._process is None:
            return True
        self._process.join(patience_s)
        return not self._process.is_alive()

    @property
    def failed(self) -> bool:
        """Whether it has ended otherwise than it should."""
        return self._process is not None and self._process.exitcode not in (None, 0)

    def kill(self) -> None:
        """Kill it, stopped or not."""
        if self._process is not None:
            self._process.kill()
            self._process.join(2.0)
