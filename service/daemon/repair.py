"""Mends what a crash has left of earlier sessions, beside the running daemon."""

import signal
from multiprocessing.context import SpawnContext
from pathlib import Path

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.recording.repair import Mended, repair
from pneuarm.logs.recording.session import unfinished


def _mend(paths: list[Path]) -> None:
    from pneuarm.service.processes import realtime

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the supervisor ends this process
    realtime.step_back(19)
    for path in paths:
        try:
            print(_outcome(path, repair(path)), flush=True)
        except LogError as error:
            print(f"WARNING    {error}", flush=True)


def _outcome(path: Path, mended: Mended) -> str:
    if mended.path is None:
        return f"WARNING    {path.name} holds nothing; set aside as {mended.kept}"
    told = f"{mended.path}: {mended.messages} messages"
    if mended.kept is None:
        return f"repaired   {told}"
    return (
        f"WARNING    repaired {told}; {mended.dropped_bytes} bytes are damaged and left out: the "
        f"original is kept as {mended.kept.name}"
    )


def start_mending(directory: Path, context: SpawnContext) -> list[Path]:
    """Start a process that repairs every unfinished file; return the files."""
    paths = unfinished(directory)
    if paths:
        context.Process(target=_mend, args=(paths,), name="repair", daemon=True).start()
    return paths
