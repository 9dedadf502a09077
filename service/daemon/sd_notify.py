"""What the service manager is told: ready, alive, stopping (the protocol of sd_notify).

A message is one datagram to the socket that ``NOTIFY_SOCKET`` names; without that variable nobody
listens and nothing is sent. The signs of life follow the loop, not this process: who calls
:meth:`ServiceManager.alive` has just seen a new tick.
"""

import contextlib
import os
import socket
from collections.abc import MutableMapping


class ServiceManager:
    """The way to whoever started this process, if that is systemd or speaks its protocol."""

    def __init__(self, environment: MutableMapping[str, str] = os.environ) -> None:
        """Take the variables out of the environment: they are not for the child processes."""
        address = environment.pop("NOTIFY_SOCKET", "")
        interval_us = environment.pop("WATCHDOG_USEC", "")
        meant = environment.pop("WATCHDOG_PID", "")
        self._address = "\0" + address[1:] if address.startswith("@") else address  # abstract
        ours = meant in ("", str(os.getpid()))
        watched_s = int(interval_us) * 1e-6 if ours and interval_us.isdecimal() else 0.0
        # A fifth of what is allowed: one that is lost or late does no harm.
        self._every_s = watched_s / 5.0
        self._said_s: float | None = None
        self._stopping = False

    def alive(self, now_s: float) -> None:
        """Say that there is a new tick: with the first one ready, then the watchdog's sign."""
        if self._said_s is None:
            self._said_s = now_s
            self._send("READY=1\nWATCHDOG=1")
        elif self._every_s and now_s - self._said_s >= self._every_s:
            self._said_s = now_s
            self._send("WATCHDOG=1")

    def stopping(self) -> None:
        """Say, once, that the end has begun; from here on the watchdog lets venting take time."""
        if not self._stopping:
            self._stopping = True
            self._send("STOPPING=1")

    def needs_longer(self, seconds: float) -> None:
        """Ask not to be killed for this much longer while the end goes on."""
        self._send(f"EXTEND_TIMEOUT_USEC={int(seconds * 1e6)}")

    def _send(self, text: str) -> None:
        """Send without ever waiting; a service manager that does not read misses something."""
        if self._address:
            kind = socket.SOCK_DGRAM | socket.SOCK_CLOEXEC | socket.SOCK_NONBLOCK
            with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, kind) as way:
                way.sendto(text.encode(), self._address)
