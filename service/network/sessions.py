"""Opening Zenoh sessions: loopback unless told otherwise, no scouting, a clear word on failure."""

import ipaddress
import json
import os
import re
import resource
import socket
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import zenoh

from pneuarm.controllers.arm.errors import ConfigurationError, DaemonUnreachable

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


def is_loopback(endpoint: str) -> bool:
    """Whether an endpoint such as ``tcp/127.0.0.1:7447`` is reached from this machine only."""
    if endpoint.startswith(("unixsock", "unixpipe")):
        return True
    address = re.split("[?#]", endpoint.partition("/")[2])[0]
    host = address.rpartition(":")[0].strip("[]")
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name
        return host == "localhost"


def read_config(config_file: str) -> zenoh.Config:
    """Read a Zenoh configuration file, or the defaults; raises ConfigurationError."""
    config: zenoh.Config = zenoh.Config()
    if not config_file:
        return config
    if not Path(config_file).is_file():
        raise ConfigurationError(f"zenoh.config_file = {config_file!r}: no such file")
    try:
        config = zenoh.Config.from_file(config_file)
    except zenoh.ZError as error:
        raise ConfigurationError(f"zenoh.config_file = {config_file!r}: {error}") from error
    return config


def check_free(key: str, endpoint: str) -> None:
    """Raise ConfigurationError if a TCP endpoint is taken already, before anything is started."""
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.rpartition(":")
    if protocol not in ("tcp", "tls") or not port.isdecimal():
        return  # Zenoh itself judges other kinds of endpoints
    if int(port) > 65535:
        raise ConfigurationError(f"{key}: port {port} of {endpoint}; allowed: 0 to 65535")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host.strip("[]"), int(port)))
        except OSError as error:
            raise ConfigurationError(
                f"{key}: {host}:{port} cannot be used ({error.strerror}); is another daemon or "
                "viewer running there? choose another port"
            ) from error


def open_listening(listen: Sequence[str], config_file: str) -> zenoh.Session:
    """Open the daemon's session; raises ConfigurationError if it cannot listen there."""
    config = read_config(config_file)
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
    except zenoh.ZError as error:
        raise ConfigurationError(
            f"zenoh.listen = {list(listen)}: cannot listen there ({_short(error)}); is another "
            "daemon running? choose another port, e.g. tcp/127.0.0.1:7448"
        ) from error


def _raise_descriptors() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _DESCRIPTORS if hard == resource.RLIM_INFINITY else min(hard, _DESCRIPTORS)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def open_connected(endpoint: str, config_file: str = "") -> zenoh.Session:
    """Open a client's session; raises DaemonUnreachable if nobody answers there."""
    config = read_config(config_file)
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    # A daemon that stands still takes the connection and says nothing; who stops waits for this.
    config.insert_json5("transport/unicast/open_timeout", "2000")
    give_up_s = time.monotonic() + _KNOCK_S
    while True:
        try:
            return _open(config)
        except zenoh.ZError as error:
            if time.monotonic() > give_up_s or not _takes_connections(endpoint):
                raise DaemonUnreachable(
                    f"nobody answers at {endpoint} ({_short(error)}); start the daemon with "
                    "`pneuarm run`, or name its address with --connect"
                ) from error
        time.sleep(0.05)


def _takes_connections(endpoint: str) -> bool:
    """Whether a TCP endpoint is listened at: then a refusal may be one of many, and pass."""
    protocol, _, address = re.split("[?#]", endpoint)[0].partition("/")
    host, _, port = address.rpartition(":")
    if protocol not in ("tcp", "tls") or not port.isdecimal():
        return False
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=0.5).close()
    except (OSError, OverflowError, UnicodeError):
        return False
    return True


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
    thread.start()
    thread.join(_OPEN_S)
    if not found:
        raise DaemonUnreachable(
            _forked(f"Zenoh did not come up within {_OPEN_S:g} s; was this process forked?")
        )
    if isinstance(found[0], BaseException):
        raise found[0]
    _opened_by = os.getpid()
    return found[0]


def _forked(cause: str) -> str:
    return (
        f"no session with the daemon: {cause} Zenoh does not survive a fork; open the client "
        'after the fork only, or start processes with multiprocessing.get_context("spawn")'
    )


def _short(error: Exception) -> str:
    return str(error).split(" at /")[0].split("\n")[0][:160]
