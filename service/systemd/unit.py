"""`pneuarm systemd`: the unit file of one daemon, with the paths of this installation."""

import argparse
import getpass
import grp
import os
import sys
from importlib.resources import files
from pathlib import Path

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.device import SerialPort
from pneuarm.service.configuration.configuration import Configuration, load
from pneuarm.service.devices import registry as backends


def systemd(arguments: argparse.Namespace) -> int:
    """Print the unit file; how to install it goes to stderr."""
    configuration = load(arguments.config, arguments.arm)
    user = arguments.user or os.environ.get("SUDO_USER") or getpass.getuser()
    print(unit_text(configuration, arguments.config, user), end="")
    if sys.stdout.isatty():
        return 0
    name = f"pneuarm-{configuration.arm.name}.service"
    print(
        f"save it as /etc/systemd/system/{name}, then: sudo systemctl daemon-reload && "
        f"sudo systemctl enable --now {name}",
        file=sys.stderr,
    )
    return 0


def unit_text(configuration: Configuration, path: Path | None, user: str) -> str:
    """Return the unit file for a configuration file, or for its built-in arm."""
    what = [str(path.resolve())] if path else ["--arm", configuration.preset]
    command = [sys.executable, "-m", "pneuarm", "run", *what]
    own: list[str] = []
    where = backends.location(configuration)
    if isinstance(where, SerialPort) and where.path:
        own = [f"DeviceAllow={_escaped(where.path)} rw"]
        own.append(f"SupplementaryGroups={_group(where.path)}")
    if configuration.log.directory:
        directory = Path(configuration.log.directory).expanduser().resolve()
        own.append(f"ReadWritePaths={_quoted(f'-{directory}')}")
    template = files("pneuarm.service.systemd").joinpath("pneuarm.service").read_text()
    return template.format(
        arm=configuration.arm.name,
        command=" ".join(_quoted(part).replace("$", "$$") for part in command),
        user=user,
        priority=configuration.control.priority,
        own="".join(f"{line}\n" for line in own),
    )


def _escaped(text: str) -> str:
    """Text as a unit file has it: a percent sign would be a specifier."""
    if any(not character.isprintable() for character in text):
        raise ConfigurationError(f"{text!r} cannot stand in a unit file; choose a plainer path")
    return text.replace("%", "%%")


def _quoted(text: str) -> str:
    """One word of a unit file, in quotation marks where it needs them."""
    escaped = _escaped(text)
    if not any(character in " \t'\"\\;" for character in escaped):
        return escaped
    return '"' + escaped.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _group(device: str) -> str:
    """Group that may open a device file; ``dialout`` where it is not plugged in."""
    try:
        return grp.getgrgid(os.stat(device).st_gid).gr_name
    except (OSError, KeyError):
        return "dialout"
