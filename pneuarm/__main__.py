"""`python -m pneuarm` and the installed command: start the command line."""

import os
import signal
from types import FrameType

from pneuarm import __version__


def _on_ctrl_c(number: int, frame: FrameType | None) -> None:
    """End without a word while a command still loads; nothing has begun yet."""
    loading = None
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            loading = frame.f_back  # in the end: who began to load
        frame = frame.f_back
    if loading is not None and loading.f_globals.get("__name__") in (
        __name__,
        "pneuarm.service.cli.parser",
    ):
        os._exit(130)
    raise KeyboardInterrupt


def main() -> None:
    """Run the command line."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not so under `nohup`
        signal.signal(signal.SIGINT, _on_ctrl_c)
    try:
        from pneuarm.service.cli.parser import main as command
    except ModuleNotFoundError as error:
        if error.name != "pneuarm.service.cli":  # what the distribution of the client leaves out
            raise
        raise SystemExit(
            "pneuarm: only the client is installed here, `from pneuarm import Client`; the daemon "
            "and the commands come with `pip install ./distributions/client .` in the checkout of "
            f"pneuarm {__version__}"
        ) from None
    raise SystemExit(command())


if __name__ == "__main__":
    main()
