"""Mends what a crash has left of earlier sessions, beside the running daemon."""

import signal
from multiprocessing.context import SpawnContext
from pathlib import Path

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.recording.session import repair, unfinished


def _mend(paths: list[Path]) -> None:
    from pneuarm.service.processes import realtime

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the supervisor ends this process
    realtime.step_back(19)
    for path in paths:
        try:
            mended, messages = repair(path)
        except LogError as error:
            print(f"WARNING    {error}", flush=True)
            continue
        if messages:
            print(f"repaired   {mended}: {messages} messages", flush=True)
        else:
            print(f"WARNING    {path.name} holds nothing; set aside as {mended.name}", flush=True)


def start_mending(directory: Path, context: SpawnContext) -> list[Path]:
    """Start a process that repairs every unfinished file; return the files."""
    paths = unfinished(directory)
    if paths:
        context.Process(target=_mend, args=(paths,), name="repair", daemon=True).start()
    return paths
