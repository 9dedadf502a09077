"""An address as Zenoh has it, such as ``tcp/127.0.0.1:7447``: read here, before Zenoh sees it."""

import ipaddress
import re
from dataclasses import dataclass

from pneuarm.controllers.arm.errors import InvalidInput

#: Those that have a host and a port, and those that have a path or a name of their own.
_WITH_PORT = ("tcp", "tls", "udp", "quic", "ws")
_OTHERS = ("unixsock-stream", "unixpipe", "serial", "vsock")

_ALLOWED = "an address is PROTOCOL/HOST:PORT, such as tcp/127.0.0.1:7447"
_LONGEST = 512


@dataclass(frozen=True)
class Endpoint:
    """A checked address; ``host`` is without brackets, ``port`` None for what has neither."""

    text: str
    protocol: str
    host: str = ""
    port: int | None = None

    @classmethod
    def parse(cls, text: str) -> "Endpoint":
        """Read an address; raises InvalidInput with what is wrong, and what is allowed."""
        protocol, _, rest = text.partition("/")
        address = re.split("[?#]", rest)[0]
        if len(text) > _LONGEST or not text.isprintable() or " " in text or not address:
            raise InvalidInput(f"{_short(text)} is no address; {_ALLOWED}")
        if protocol in _OTHERS:
            return cls(text, protocol)
        if protocol not in _WITH_PORT:
            known = ", ".join((*_WITH_PORT, *_OTHERS))
            raise InvalidInput(f"{_short(text)}: protocol {protocol!r}; allowed: {known}")
        host, _, port = address.rpartition(":")
        if not host or not re.fullmatch("[0-9]{1,9}", port) or int(port) > 65535:
            raise InvalidInput(
                f"{_short(text)} needs a host, a colon and a port from 0 to 65535; {_ALLOWED}"
            )
        if ":" in host and not _is_bracketed(host):
            raise InvalidInput(
                f"{_short(text)}: an IPv6 address stands in brackets, such as tcp/[::1]:7447"
            )
        return cls(text, protocol, host.strip("[]"), int(port))

    @property
    def is_loopback(self) -> bool:
        """Whether it is reached from this machine only."""
        if self.protocol in ("unixsock-stream", "unixpipe"):
            return True
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:  # a name
            return self.host == "localhost"

    @property
    def is_tcp(self) -> bool:
        """Whether a TCP connection to it can be tried."""
        return self.protocol in ("tcp", "tls")


def _is_bracketed(host: str) -> bool:
    try:
        return host == f"[{host[1:-1]}]" and ipaddress.ip_address(host[1:-1]).version == 6
    except ValueError:
        return False


def _short(text: str) -> str:
    return repr(text if len(text) <= 80 else f"{text[:77]}...")


def in_url(host: str) -> str:
    """Return a host as an address with a port has it: IPv6 in brackets."""
    return f"[{host}]" if ":" in host else host
