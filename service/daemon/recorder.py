"""The recorder process: drains the rings into the session's files until there is nothing more."""

import time
from multiprocessing.connection import Connection

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.recording.recorder import Recorder, RecorderSettings
from pneuarm.service.configuration.configuration import log_directory
from pneuarm.service.processes import realtime
from pneuarm.service.processes.shared import Shared, ignore_terminal_signals, parent_is_alive

_MIB = 1024 * 1024
_IDLE_S = 0.02

#: After the order to end: the writers have stopped when nothing came for this long.
_QUIET_S = 0.2

#: Where the system grants it: what the recorder does is little, and nobody else can do it later.
_AHEAD_OF_OTHERS = 10

#: How long a full disk is tried again at the end before what is left is given up.
_GIVE_UP_S = 10.0


def settings(shared: Shared) -> RecorderSettings:
    """Return what the recorder needs, from the configuration."""
    log = shared.configuration.log
    return RecorderSettings(
        directory=log_directory(shared.configuration),
        session=shared.session,
        arm=shared.configuration.build_arm(),
        roll_bytes=int(log.roll_mib * _MIB),
        roll_s=log.roll_minutes * 60.0,
        keep_bytes=int(log.keep_gib * 1024 * _MIB),
        min_free_bytes=int(log.min_free_mib * _MIB),
    )


def main(shared: Shared, end: Connection) -> None:
    """Entry point of the process; ends when told through ``end``, or when its parent is gone."""
    ignore_terminal_signals()
    realtime.step_forward(_AHEAD_OF_OTHERS)
    recorder = Recorder(settings(shared), shared.info, shared.rings, shared.recorder)
    while not end.poll() and parent_is_alive():
        if recorder.step() == 0:
            time.sleep(_IDLE_S)
    quiet_since = time.monotonic()
    while time.monotonic() - quiet_since < _QUIET_S:
        if recorder.step():
            quiet_since = time.monotonic()
        else:
            time.sleep(_IDLE_S)
    _finish(recorder)


def _finish(recorder: Recorder) -> None:
    give_up_s = time.monotonic() + _GIVE_UP_S
    while True:
        try:
            recorder.finish()
        except OSError as error:
            if time.monotonic() > give_up_s:
                raise LogError(
                    f"the log could not be closed ({error.strerror}) and lacks its end; free some "
                    "space, and the next start repairs it"
                ) from error
            time.sleep(0.5)
        else:
            return
