"""`python -m pneuarm` and the installed command: start the command line."""

import os
import signal
import sys
from collections.abc import Sequence
from types import FrameType

from pneuarm import __version__


def asks_to_stop(words: Sequence[str]) -> bool:
    """Whether somebody wants the arm stopped: also by what is no command, in the hurry."""
    first = words[0] if words else ""
    return "stop" in first.lower() or (first.startswith("-") and "estop" in words)


#: Also to be said where nothing else of pneuarm can be loaded.
_STOPS = asks_to_stop(sys.argv[1:])


def _sentence(text: str) -> str:
    return f"pneuarm: NOT CONFIRMED: {text}; cut the air supply" if _STOPS else f"pneuarm: {text}"


def _on_signal(number: int, frame: FrameType | None) -> None:
    """End without a word while a command still loads, for nothing has begun yet; else raise."""
    if number != signal.SIGINT:  # a second one would cut short what the first has begun to end
        signal.signal(number, signal.SIG_IGN)
    loading = None
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            loading = frame.f_back  # in the end: who began to load
        frame = frame.f_back
    if loading is not None and loading.f_globals.get("__name__") in (
        __name__,
        "pneuarm.service.cli.parser",
    ):
        if _STOPS:
            os.write(2, f"{_sentence('it was interrupted before it began')}\n".encode())
        os._exit(128 + number)
    raise KeyboardInterrupt(number)


def _take_signals() -> None:
    """Every order to end is an exception, as Ctrl-C is: what was begun is ended in its order."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not so under `nohup`
        signal.signal(signal.SIGINT, _on_signal)
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _on_signal)


def _open_standard_streams() -> None:
    """Give what was started without them streams that lead nowhere.

    Else the next file that is opened would be one of them, and be written to.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free


def _why_not_loaded(error: Exception) -> str:
    if isinstance(error, ModuleNotFoundError) and error.name == "pneuarm.service.cli":
        return (  # which the distribution of the client leaves out
            "only the client is installed here, `from pneuarm import Client`; the daemon and the "
            "commands come with `pip install ./distributions/client .` in the checkout of "
            f"pneuarm {__version__}"
        )
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return f"the command line cannot be loaded: {what}"


def main() -> None:
    """Run the command line."""
    _take_signals()
    _open_standard_streams()
    try:
        from pneuarm.service.cli.parser import main as command
    except Exception as error:  # a machine that has run out of something, too
        raise SystemExit(_sentence(_why_not_loaded(error))) from None
    raise SystemExit(command())


if __name__ == "__main__":
    main()
