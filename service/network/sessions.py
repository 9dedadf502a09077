"""Opening Zenoh sessions: loopback unless told otherwise, no scouting, a clear word on failure."""

import contextlib
import json
import os
import resource
import socket
import threading
import time
from collections.abc import Iterator, Sequence

import zenoh

from pneuarm.controllers.arm.errors import ConfigurationError, DaemonUnreachable, InvalidInput
from pneuarm.service.network.endpoint import Endpoint, in_url

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"

#: What the daemon bears of strangers, where a Zenoh file leaves Zenoh's own default. By that, a
#: hundred connections that say nothing keep every new client out for ten seconds, and one message
#: may have a gigabyte. One in shared memory escapes that limit, and could change after its check.
_BORNE = {
    "transport/unicast/accept_pending": "1000",
    "transport/unicast/accept_timeout": "1000",  # ms
    "transport/link/rx/max_message_size": "1048576",  # bytes
    "transport/shared_memory/enabled": "false",
}

#: Connections need file descriptors; the usual limit of 1024 is no more than may be pending.
_DESCRIPTORS = 16384

#: A daemon at its limit of pending connections turns a client away: tried again for so long (s).
_KNOCK_S = 3.0

#: Zenoh answers within its own time-outs; in a process forked from one that used it, never.
_OPEN_S = 8.0

_opened_by: int | None = None  # number of the process that has opened a session


def read_config(config_file: str) -> zenoh.Config:
    """Read a Zenoh configuration file, or the defaults; raises ConfigurationError."""
    config: zenoh.Config = zenoh.Config()
    if not config_file:
        return config
    where = f"zenoh.config_file = {config_file!r}"
    if "\0" in config_file or not os.path.exists(config_file):
        raise ConfigurationError(f"{where}: no such file")
    if not os.path.isfile(config_file):
        raise ConfigurationError(f"{where}: it is a folder, a pipe or a device, not a file")
    try:
        with failing_in_words():
            config = zenoh.Config.from_file(config_file)
    except ZenohFailed as error:
        raise ConfigurationError(f"{where}: {error}") from error
    return config


def check_free(key: str, text: str) -> None:
    """Raise ConfigurationError if a TCP endpoint is taken already, before anything is started."""
    endpoint = _endpoint(key, text)
    if endpoint.is_tcp and endpoint.port is not None:  # Zenoh itself judges other kinds
        _bind(key, endpoint.host, endpoint.port)


def check_here(key: str, text: str) -> None:
    """Raise ConfigurationError if a TCP endpoint cannot be listened at here, on whatever port."""
    endpoint = _endpoint(key, text)
    if endpoint.is_tcp:
        _bind(key, endpoint.host, 0)


def _bind(key: str, host: str, port: int) -> None:
    """Listen nowhere, but see whether it would be possible; port 0 is any that is free."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except (OSError, UnicodeError) as error:
            where = f"{in_url(host)}:{port}" if port else in_url(host)
            taken = "is another daemon or viewer running there, or " if port else ""
            raise ConfigurationError(
                f"{key}: {where} cannot be used ({_why(error)}); {taken}is it no address of this "
                "machine? choose another"
            ) from error


def _endpoint(key: str, text: str) -> Endpoint:
    try:
        return Endpoint.parse(text)
    except InvalidInput as error:
        raise ConfigurationError(f"{key}: {error}") from error


def _why(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)


def open_listening(listen: Sequence[str], config_file: str) -> zenoh.Session:
    """Open the daemon's session; raises ConfigurationError if it cannot listen there."""
    config = read_config(config_file)
    for text in listen:
        _endpoint("zenoh.listen", text)
    config.insert_json5("mode", '"router"')
    config.insert_json5("listen/endpoints", json.dumps(list(listen)))
    config.insert_json5("listen/exit_on_failure", "true")
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    # Nobody is waited for: the daemon is where the others connect to.
    config.insert_json5("open/return_conditions/connect_scouted", "false")
    config.insert_json5("open/return_conditions/declares", "false")
    own = zenoh.Config()
    for key, value in _BORNE.items():
        if config.get_json(key) == own.get_json(key):
            config.insert_json5(key, value)
    _raise_descriptors()
    try:
        return _open(config)
    except ZenohFailed as error:
        raise ConfigurationError(
            f"zenoh.listen = {list(listen)}: cannot listen there ({error}); is another "
            "daemon running? choose another port, e.g. tcp/127.0.0.1:7448"
        ) from error


def _raise_descriptors() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _DESCRIPTORS if hard == resource.RLIM_INFINITY else min(hard, _DESCRIPTORS)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def open_connected(connect: str, config_file: str = "") -> zenoh.Session:
    """Open a client's session.

    Raises InvalidInput for what is no address, DaemonUnreachable if nobody answers there.
    """
    endpoint = Endpoint.parse(connect)
    config = read_config(config_file)
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([connect]))
    config.insert_json5("scouting/multicast/enabled", "false")
    # A daemon that stands still takes the connection and says nothing; who stops waits for this.
    config.insert_json5("transport/unicast/open_timeout", "2000")
    give_up_s = time.monotonic() + _KNOCK_S
    while True:
        try:
            return _open(config)
        except ZenohFailed as error:
            if time.monotonic() > give_up_s or not _takes_connections(endpoint):
                raise DaemonUnreachable(
                    f"nobody answers at {connect} ({error}); start the daemon with "
                    "`pneuarm run`, or name its address with --connect"
                ) from error
        time.sleep(0.05)


def _takes_connections(endpoint: Endpoint) -> bool:
    """Whether a TCP endpoint is listened at: then a refusal may be one of many, and pass."""
    if not endpoint.is_tcp or endpoint.port is None:
        return False
    try:
        socket.create_connection((endpoint.host, endpoint.port), timeout=0.5).close()
    except (OSError, UnicodeError):
        return False
    return True


class ZenohFailed(DaemonUnreachable):
    """Zenoh raised something; the text is the first line of it."""


@contextlib.contextmanager
def failing_in_words() -> Iterator[None]:
    """Turn whatever a call of Zenoh's raises into ZenohFailed, its panics too."""
    try:
        yield
    except (KeyboardInterrupt, SystemExit, GeneratorExit):
        raise
    except BaseException as error:  # a panic is no Exception
        raise ZenohFailed(_short(error)) from error


def _open(config: zenoh.Config) -> zenoh.Session:
    """Open a session; raises DaemonUnreachable where Zenoh would hang for ever, after a fork."""
    global _opened_by
    if _opened_by not in (None, os.getpid()):
        raise DaemonUnreachable(_forked("this process was forked from one with a session open."))
    found: list[zenoh.Session | BaseException] = []

    def open_it() -> None:
        try:
            found.append(zenoh.open(config))
        except BaseException as error:  # handed to who waits below
            found.append(error)

    thread = threading.Thread(target=open_it, name="opening zenoh", daemon=True)
    with failing_in_words():
        thread.start()
    thread.join(_OPEN_S)
    if not found:
        raise DaemonUnreachable(
            _forked(f"Zenoh did not come up within {_OPEN_S:g} s; was this process forked?")
        )
    if isinstance(found[0], BaseException):
        with failing_in_words():
            raise found[0]
    _opened_by = os.getpid()
    return found[0]


def _forked(cause: str) -> str:
    return (
        f"no session with the daemon: {cause} Zenoh does not survive a fork; open the client "
        'after the fork only, or start processes with multiprocessing.get_context("spawn")'
    )


def _short(error: BaseException) -> str:
    return str(error).split(" at /")[0].split("\n")[0][:160].strip() or type(error).__name__
