"""Whether the arm's device can be reached, without a word to it: nothing is read or written."""

import grp
import os
import shlex
import socket
import time

from pneuarm.hardware.device import Bus, SerialPort, TcpPort
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.devices import registry as backends
from pneuarm.service.doctor.finding import Finding, Verdict
from pneuarm.service.processes.user import user_name

_NAME = "device"
_PATIENCE_S = 1.0


def reachable(configuration: Configuration) -> Finding:
    """Look for the configured device: a file for a serial line, a connection for the network."""
    match backends.location(configuration):
        case SerialPort("") | TcpPort(""):
            return Finding(_NAME, Verdict.INFO, "nobody has said where it is")
        case SerialPort(path):
            return serial(path)
        case TcpPort(host, port):
            return network(host, port)
        case Bus(name):
            return Finding(_NAME, Verdict.INFO, f"{name} cannot be tried from here")
    return Finding(_NAME, Verdict.OK, "in this machine's memory: there is nothing to reach")


def serial(path: str) -> Finding:
    """Look at a device file: is it there, and may we open it."""
    if not os.path.exists(path):
        remedy = "ls -l /dev/serial/by-id/   # names that stay the same when it is plugged in anew"
        return Finding(_NAME, Verdict.FAILED, f"{path} is not there: is it plugged in?", remedy)
    if not os.access(path, os.R_OK | os.W_OK):
        return Finding(
            _NAME,
            Verdict.FAILED,
            f"{path} may not be opened by {user_name()}",
            f"sudo usermod -aG {_group(path)} {user_name()}   # then log out and in again",
        )
    return Finding(_NAME, Verdict.OK, f"{path} is there and may be opened")


def _group(path: str) -> str:
    try:
        return grp.getgrgid(os.stat(path).st_gid).gr_name
    except KeyError:
        return "dialout"


def network(host: str, port: int) -> Finding:
    """Open a connection to a device and close it again."""
    start_s = time.monotonic()
    try:
        socket.create_connection((host, port), _PATIENCE_S).close()
    except OSError as error:
        why = "no answer" if isinstance(error, TimeoutError) else error.strerror or str(error)
        remedy = f"ping -c 3 {shlex.quote(host)}   # is it on, and in this PC's network?"
        text = f"{host} port {port} cannot be reached ({why})"
        return Finding(_NAME, Verdict.FAILED, text, remedy)
    took_ms = 1e3 * (time.monotonic() - start_s)
    text = f"{host} port {port} answers in {took_ms:.1f} ms"
    return Finding(_NAME, Verdict.OK, text, values={"connect_ms": took_ms})
