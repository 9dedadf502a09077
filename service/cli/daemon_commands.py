"""`pneuarm run` and `pneuarm config`."""

import argparse
import contextlib
import queue
import threading

from pneuarm.service.configuration.configuration import load, rerun_url


def run(arguments: argparse.Namespace) -> int:
    """Run the daemon until SIGINT or SIGTERM."""
    from pneuarm.service.daemon.supervisor import Supervisor

    configuration = load(arguments.config, arguments.arm)
    if arguments.viewer:
        rerun = configuration.rerun.model_copy(update={"open_viewer": True})
        configuration = configuration.model_copy(update={"rerun": rerun})
    terminal = Terminal()
    try:
        return Supervisor(configuration, terminal.say).run()
    finally:
        terminal.close()


class Terminal:
    """Prints from a thread of its own: a terminal that is paused must not stop the supervisor."""

    def __init__(self) -> None:
        self._lines: queue.Queue[str | None] = queue.Queue(1000)
        self._thread = threading.Thread(target=self._print, daemon=True)
        self._thread.start()

    def say(self, line: str) -> None:
        """Print a line soon; a terminal that is 1000 lines behind gets no more."""
        with contextlib.suppress(queue.Full):
            self._lines.put_nowait(line)

    def _print(self) -> None:
        with contextlib.suppress(OSError):
            while (line := self._lines.get()) is not None:
                print(line, flush=True)

    def close(self) -> None:
        """Give what is left a second to appear."""
        with contextlib.suppress(queue.Full):
            self._lines.put_nowait(None)
        self._thread.join(1.0)


def config(arguments: argparse.Namespace) -> int:
    """Print the effective configuration, or say that a file is right."""
    configuration = load(arguments.config, arguments.arm)
    if arguments.action == "show":
        print(configuration.to_toml(), end="")
    else:
        from pneuarm.service.daemon.requirements import check_machine

        check_machine(configuration)
        sections = len(configuration.arm.sections)
        where = arguments.config or f"preset {configuration.preset}"
        print(
            f"{where}: good; arm {configuration.arm.name}, {3 * sections} chambers, "
            f"{configuration.control.rate_hz:g} Hz, view at {rerun_url(configuration)}"
        )
    return 0
