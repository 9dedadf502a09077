"""What a configuration says about reaching its device, whatever the adapter is."""

import re
from collections.abc import Iterator
from typing import Any

from pneuarm.service.configuration.configuration import Configuration

_PORT_KEYS = ("port", "tcp_port")
_MODBUS_PORT = 502


def serial_paths(configuration: Configuration) -> list[str]:
    """Return the device files that the adapter opens, such as ``/dev/ttyUSB0``."""
    found = (text for _, text in _texts(_tables(configuration)) if text.startswith("/dev/"))
    return list(dict.fromkeys(found))


def tcp_address(configuration: Configuration) -> tuple[str, int] | None:
    """Return host and port of a device on the network, or None; the port is Modbus's by default."""
    tables = _tables(configuration)
    named = {key: text for key, text in _texts(tables) if text and not text.startswith("/")}
    text = next((named[key] for key in ("host", "address", "device") if key in named), "")
    host, _, port = text.rpartition(":") if re.fullmatch(r".+:\d+", text) else (text, "", "")
    if not host:
        return None
    numbers = (value for table in tables for key, value in table.items() if key in _PORT_KEYS)
    configured = next((value for value in numbers if isinstance(value, int)), _MODBUS_PORT)
    return host, int(port) if port else configured


def _tables(configuration: Configuration) -> list[dict[str, Any]]:
    """Return the adapter's own table, if it has one, and `hardware`."""
    tables = configuration.model_dump()
    own = configuration.hardware.adapter.replace("-", "_")
    return [tables[name] for name in (own, "hardware") if isinstance(tables.get(name), dict)]


def _texts(tables: list[dict[str, Any]]) -> Iterator[tuple[str, str]]:
    """Return the texts in tables and in what is nested in them, each with its key."""
    for table in tables:
        for key, value in table.items():
            if isinstance(value, str):
                yield key, value
            elif isinstance(value, dict):
                yield from _texts([value])
