"""A child process of the daemon: started with spawn, ended by a word, revived if it may be."""

import importlib
import os
import signal
import sys
import time
from collections.abc import Callable
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess

from pneuarm.controllers.arm.errors import PneuarmError
from pneuarm.service.processes.usage import ProcessTable

_REVIVE_AFTER_S = 1.0

#: How often somebody who ends a process looks how far it is.
_LOOK_S = 0.5


def enter(name: str, module: str, arguments: tuple[object, ...]) -> None:
    """Run a process's own `main`; this is what the new interpreter starts with."""
    main: Callable[..., None] = importlib.import_module(module).main
    try:
        main(*arguments)
    except PneuarmError as error:
        print(f"ERROR      {name}: {error}", file=sys.stderr, flush=True)
        os._exit(1)  # a library's threads might keep the process from ending
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)  # nothing is left to do, and the garbage of a frozen heap is nobody's business


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
        """Start it again if it is dead, at most once a second; return whether it was."""
        if self.is_alive() or time.monotonic() - self._started_s < _REVIVE_AFTER_S:
            return False
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
