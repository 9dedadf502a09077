"""Opening Zenoh sessions: loopback unless told otherwise, no scouting, a clear word on failure."""

import ipaddress
import json
import re
import socket
from collections.abc import Sequence
from pathlib import Path

import zenoh

from pneuarm.controllers.arm.errors import ConfigurationError, DaemonUnreachable

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"


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
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise ConfigurationError(
            f"zenoh.listen = {list(listen)}: cannot listen there ({_short(error)}); is another "
            "daemon running? choose another port, e.g. tcp/127.0.0.1:7448"
        ) from error


def open_connected(endpoint: str, config_file: str = "") -> zenoh.Session:
    """Open a client's session; raises DaemonUnreachable if nobody answers there."""
    config = read_config(config_file)
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    # A daemon that stands still takes the connection and says nothing; who stops waits for this.
    config.insert_json5("transport/unicast/open_timeout", "2000")
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise DaemonUnreachable(
            f"nobody answers at {endpoint} ({_short(error)}); start the daemon with "
            "`pneuarm run`, or name its address with --connect"
        ) from error


def _short(error: Exception) -> str:
    return str(error).split(" at /")[0].split("\n")[0][:160]
