"""What the daemon needs besides the processor: disk, shared memory, ports, packages."""

import os
import platform
import shutil
import tempfile
import time
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement

from pneuarm.controllers.arm.errors import AlreadyInUse, ConfigurationError
from pneuarm.logs.rings.rings import HOLD_S
from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.service.configuration.configuration import Configuration, log_directory
from pneuarm.service.devices import registry as backends
from pneuarm.service.doctor.finding import Finding, Verdict
from pneuarm.service.processes.lock import lock

_MIB = 1024 * 1024
_PROBE_MIB = 16
#: A session of one section at 1 kHz takes about 1 MiB/s; the recorder shares the disk.
_SLOW_MIB_S = 10.0
#: Rings of messages beside the ring of ticks, and what comes with each record.
_MESSAGES_MIB, _SLOT_BYTES = 48, 80
_SHOWN = ("eclipse-zenoh", "rerun-sdk", "mcap", "osqp", "casadi", "numpy")


def sessions(configuration: Configuration) -> Finding:
    """Look at the disk that sessions go to: free space, and how fast it writes."""
    name, directory = "sessions", log_directory(configuration)
    place = next(filter(os.path.lexists, (directory, *directory.absolute().parents)))
    try:
        free_mib = shutil.disk_usage(place).free / _MIB
        speed = _write_speed(place)
    except OSError as error:
        text = f"{directory} cannot be written to ({error.strerror})"
        remedy = f"sudo install -d -o $USER {directory}   # or set log.directory"
        return Finding(name, Verdict.FAILED, text, remedy)
    text = f"{directory}: {free_mib / 1024:.1f} GiB free, {speed:.0f} MiB/s"
    values = {"free_mib": free_mib, "write_mib_s": speed}
    if free_mib < configuration.log.min_free_mib:
        text += f"; below log.min_free_mib = {configuration.log.min_free_mib:g}: no recording"
        remedy = f"du -sh {directory}/*   # delete or move what is not needed"
        return Finding(name, Verdict.FAILED, text, remedy, values)
    if speed < _SLOW_MIB_S:
        text += ": too slow to keep up for long"
        return Finding(name, Verdict.WARNING, text, "set log.directory to a local disk", values)
    return Finding(name, Verdict.OK, text, values=values)


def _write_speed(place: Path) -> float:
    """Write a nameless file to the disk; return MiB/s."""
    block = os.urandom(_MIB)
    with tempfile.TemporaryFile(dir=place) as file:
        start_s = time.monotonic()
        for _ in range(_PROBE_MIB):
            file.write(block)
        file.flush()
        os.fsync(file.fileno())
        return _PROBE_MIB / max(time.monotonic() - start_s, 1e-6)


def shared_memory(configuration: Configuration, place: Path = Path("/dev/shm")) -> Finding:
    """See whether the rings between the processes fit into shared memory."""
    name = "shared memory"
    ticks = int(1.1 * HOLD_S * configuration.control.rate_hz)
    slot = tick_dtype(len(configuration.arm.sections)).itemsize + _SLOT_BYTES
    need_mib = ticks * slot / _MIB + _MESSAGES_MIB
    if not place.is_dir():
        text = f"{place} is not there: the rings would lie on a disk"
        return Finding(name, Verdict.WARNING, text, f"sudo mount -t tmpfs tmpfs {place}")
    free_mib = shutil.disk_usage(place).free / _MIB
    text = f"{place}: {free_mib:.0f} MiB free, about {need_mib:.0f} needed"
    values = {"free_mib": free_mib, "need_mib": need_mib}
    if free_mib < need_mib:
        remedy = f"sudo mount -o remount,size=512M {place}   # in a container: --shm-size 512m"
        return Finding(name, Verdict.FAILED, text, remedy, values)
    return Finding(name, Verdict.OK, text, values=values)


def other_daemon(configuration: Configuration) -> Finding:
    """See whether another daemon has the arm's name or the device."""
    name = "arm and device"
    for kind, value in (
        ("arm", configuration.arm.name),
        ("device", backends.address(configuration)),
    ):
        try:
            lock(kind, value).close()
        except AlreadyInUse as error:
            number = error.process_id
            who = f"process {number}" if number else "another process"
            text = f"{kind} {value} is in use by a running daemon ({who})"
            remedy = f"kill {number}   # it vents the arm and ends" if number else ""
            return Finding(name, Verdict.WARNING, text, remedy)
    return Finding(name, Verdict.OK, f"{configuration.arm.name}: no other daemon has it")


def ports(configuration: Configuration) -> Finding:
    """See whether Zenoh and Rerun can listen where they are told to."""
    from pneuarm.service.network.endpoint import in_url
    from pneuarm.service.network.sessions import check_free

    name, wanted = "ports", [("zenoh.listen", text) for text in configuration.zenoh.listen]
    if configuration.rerun.enabled and configuration.rerun.start_server:
        rerun = configuration.rerun
        wanted.append(("rerun.port", f"tcp/{in_url(rerun.bind)}:{rerun.port}"))
    for key, endpoint in wanted:
        try:
            check_free(key, endpoint)
        except ConfigurationError as error:
            port = endpoint.rpartition(":")[2]
            return Finding(name, Verdict.FAILED, str(error), f"ss -ltnp 'sport = :{port}'")
    return Finding(name, Verdict.OK, f"free: {', '.join(endpoint for _, endpoint in wanted)}")


def packages() -> Finding:
    """Compare what is installed with what pneuarm asks for."""
    name, python = "packages", f"Python {platform.python_version()}"
    try:
        asked = metadata.requires("pneuarm") or []
    except metadata.PackageNotFoundError:
        return Finding(name, Verdict.INFO, f"{python}; pneuarm runs without being installed")
    wrong = []
    for requirement in map(Requirement, asked):
        if requirement.marker is not None and not requirement.marker.evaluate():
            continue
        try:
            found = metadata.version(requirement.name)
        except metadata.PackageNotFoundError:
            found = ""
        if not requirement.specifier.contains(found or "0", prereleases=True):
            wrong.append(f"{requirement} (found {found or 'none'})")
    if wrong:
        text = f"not as asked for: {'; '.join(wrong)}"
        return Finding(name, Verdict.FAILED, text, "make setup")
    shown = ", ".join(f"{package} {metadata.version(package)}" for package in _SHOWN)
    return Finding(name, Verdict.OK, f"{python}, {shown}")
