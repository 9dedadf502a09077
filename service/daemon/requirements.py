"""What a daemon needs of this machine before anything is started: files, a folder, free ports."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.service.configuration.configuration import Configuration, log_directory
from pneuarm.service.devices import registry as backends
from pneuarm.service.network.endpoint import in_url
from pneuarm.service.network.sessions import check_free, check_here, read_config
from pneuarm.service.wire.tip_pose_source import read_key


def check_machine(configuration: Configuration) -> None:
    """Raise ConfigurationError for what cannot be read, written or listened at here.

    Changes nothing; a port that is taken may be a daemon's that runs, see :func:`check_ports`.
    """
    backends.check(configuration)
    read_config(configuration.zenoh.config_file)
    read_key(configuration.feedback)
    for key, _, endpoint in _endpoints(configuration):
        check_here(key, endpoint)
    directory = log_directory(configuration)
    _try_to_write(directory, next(filter(os.path.lexists, _upward(directory))))


def check_ports(configuration: Configuration) -> None:
    """Raise ConfigurationError for a port that somebody listens at."""
    for _, key, endpoint in _endpoints(configuration):
        check_free(key, endpoint)


def _endpoints(configuration: Configuration) -> Iterator[tuple[str, str, str]]:
    """Yield where the daemon is to listen, behind the keys of the address and of the port."""
    for endpoint in configuration.zenoh.listen:
        yield "zenoh.listen", "zenoh.listen", endpoint
    rerun = configuration.rerun
    if rerun.enabled and rerun.start_server:
        yield "rerun.bind", "rerun.port", f"tcp/{in_url(rerun.bind)}:{rerun.port}"


def make_directory(configuration: Configuration) -> Path:
    """Make the folder of the sessions; raises ConfigurationError where it cannot be used."""
    directory = log_directory(configuration)
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unusable(directory, error) from error
    _try_to_write(directory, directory)
    return directory


def _upward(directory: Path) -> list[Path]:
    return [directory.absolute(), *directory.absolute().parents]


def _try_to_write(directory: Path, there: Path) -> None:
    """Write a nameless file into what is there of a folder."""
    try:
        tempfile.TemporaryFile(dir=there).close()
    except OSError as error:
        raise _unusable(directory, error) from error


def _unusable(directory: Path, error: OSError) -> ConfigurationError:
    return ConfigurationError(
        f"log.directory: {directory} cannot be written to ({error.strerror}); name a folder that "
        "this user may write to"
    )
