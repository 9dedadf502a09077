"""`pneuarm doctor`: all checks in their order, one line each."""

import argparse
import json
from collections.abc import Callable, Iterator
from pathlib import Path

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.service.configuration.configuration import Configuration, load
from pneuarm.service.configuration.devices import devices
from pneuarm.service.devices import registry as backends
from pneuarm.service.doctor import device, machine, places, rights, timing
from pneuarm.service.doctor.finding import Finding, Verdict, summary

_PATIENT = ("ports", "device")


def doctor(arguments: argparse.Namespace) -> int:
    """Check this PC; 1 if something must be changed."""
    findings = []
    for finding in examine(arguments.config, arguments.arm):
        findings.append(finding)
        if not arguments.json:
            print("\n".join(finding.lines()), flush=True)
    failed = any(finding.verdict is Verdict.FAILED for finding in findings)
    if arguments.json:
        told = [vars(finding) for finding in findings]
        print(json.dumps({"ready": not failed, "findings": told}, indent=2))
    else:
        print(f"\n{summary(findings)}")
    return int(failed)


def examine(path: Path | None, preset: str | None) -> Iterator[Finding]:
    """Make all checks; a configuration that is wrong leaves out those that need it."""
    configuration: Configuration | None = None
    try:
        configuration = load(path, preset)
    except ConfigurationError as error:
        yield Finding("configuration", Verdict.FAILED, str(error))
    if configuration is not None:
        yield _configuration(configuration, path)
    yield from _machine(configuration or load())
    if configuration is not None:
        yield from _daemon(configuration)


def _configuration(configuration: Configuration, path: Path | None) -> Finding:
    arm = configuration.arm
    text = (
        f"{path or f'preset {configuration.preset}'}: arm {arm.name}, "
        f"{3 * len(arm.sections)} chambers, {configuration.control.rate_hz:g} Hz, "
        f"adapter {configuration.hardware.adapter}"
    )
    try:
        backends.check(configuration)
    except ConfigurationError as error:
        return Finding("configuration", Verdict.FAILED, f"{text}\n{error}")
    broken = list(devices().broken.values())
    if broken:
        remedy = f"pip uninstall {broken[0].package}   # or mend it"
        whole = "\n".join((text, *map(str, broken)))
        return Finding("configuration", Verdict.WARNING, whole, remedy)
    return Finding("configuration", Verdict.OK, text)


def _machine(configuration: Configuration) -> Iterator[Finding]:
    checks: tuple[Callable[[], Finding], ...] = (
        lambda: rights.priority(configuration.control.priority),
        rights.memory,
        machine.cores,
        machine.governor,
        machine.kernel,
        machine.clock_source,
        lambda: timing.wake_up(configuration.control),
        timing.wall_clock,
        places.packages,
    )
    return (check() for check in checks)


def _daemon(configuration: Configuration) -> Iterator[Finding]:
    yield places.sessions(configuration)
    yield places.shared_memory(configuration)
    other = places.other_daemon(configuration)
    yield other
    if other.verdict is Verdict.OK:
        yield places.ports(configuration)
        yield device.reachable(configuration)
    else:  # its ports are taken, and a device may take one connection only
        yield from (Finding(name, Verdict.INFO, "left alone while it runs") for name in _PATIENT)
