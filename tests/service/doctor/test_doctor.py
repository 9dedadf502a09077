"""The doctor's checks against machines as they may be, and the command against this one."""

import json
import os
import re
import socket
from pathlib import Path

import pytest

from pneuarm.hardware.device import Bus
from pneuarm.service.configuration.configuration import Configuration, load
from pneuarm.service.control.clock import Wake
from pneuarm.service.devices import registry
from pneuarm.service.doctor import device, machine, places, rights, timing
from pneuarm.service.doctor.command import examine
from pneuarm.service.doctor.finding import Finding, Verdict, summary
from pneuarm.service.processes.lock import lock
from pneuarm.service.systemd.unit import unit_text
from tools.rig.daemon import ROOT, Daemon, free_port, run_command


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


@pytest.mark.parametrize(
    ("governors", "verdict"),
    [
        ([], Verdict.INFO),
        (["performance", "performance"], Verdict.OK),
        (["performance", "powersave"], Verdict.WARNING),
    ],
)
def test_governor(tmp_path: Path, governors: list[str], verdict: Verdict) -> None:
    for number, text in enumerate(governors):
        write(tmp_path / f"sys/devices/system/cpu/cpu{number}/cpufreq/scaling_governor", text)
    finding = machine.governor(tmp_path)
    assert finding.verdict is verdict
    assert bool(finding.remedy) == (verdict is Verdict.WARNING)


@pytest.mark.parametrize(
    ("source", "verdict"),
    [("", Verdict.INFO), ("tsc\n", Verdict.OK), ("hpet\n", Verdict.WARNING)],
)
def test_clock_source(tmp_path: Path, source: str, verdict: Verdict) -> None:
    write(tmp_path / "sys/devices/system/clocksource/clocksource0/current_clocksource", source)
    assert machine.clock_source(tmp_path).verdict is verdict


def test_a_busy_machine_and_one_with_a_quota_are_told(tmp_path: Path) -> None:
    write(tmp_path / "proc/loadavg", "0.10 0.1 0.1 1/100 1")
    assert machine.cores(tmp_path).text.endswith("load 0.10")
    write(tmp_path / "proc/loadavg", "900.0 0.1 0.1 1/100 1")
    assert machine.cores(tmp_path).verdict is Verdict.WARNING
    write(tmp_path / "sys/fs/cgroup/cpu.max", "150000 100000\n")
    finding = machine.cores(tmp_path)
    assert finding.verdict is Verdict.WARNING
    assert "1.5 of them" in finding.text
    write(tmp_path / "sys/fs/cgroup/cpu.max", "max 100000\n")
    assert "of them" not in machine.cores(tmp_path).text


def test_the_kernel_with_real_time_preemption_is_known(tmp_path: Path) -> None:
    write(tmp_path / "sys/kernel/realtime", "1\n")
    assert machine.kernel(tmp_path).verdict is Verdict.OK


def test_capabilities_are_read_bit_by_bit() -> None:
    status = "Name:\tpython\nCapEff:\t0000000000804000\n"
    assert rights.has_capability(23, status)
    assert rights.has_capability(14, status)
    assert not rights.has_capability(24, status)
    assert not rights.has_capability(23, "Name:\tpython\n")


@pytest.mark.parametrize("container", [False, True])
def test_without_rights_the_remedy_can_be_pasted(
    monkeypatch: pytest.MonkeyPatch, container: bool
) -> None:
    def refuse(*arguments: object) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(rights.resource, "getrlimit", lambda kind: (0, 0))
    monkeypatch.setattr(rights, "_status", lambda: "CapEff:\t0\n")
    monkeypatch.setattr(rights, "in_container", lambda: container)
    for finding, key in ((rights.priority(80), "rtprio"), (rights.memory(), "memlock")):
        assert finding.verdict is Verdict.WARNING
        expected = f"--ulimit {key}=" if container else f" - {key} "
        assert expected in finding.remedy
        assert ("sudo tee" in finding.remedy) != container


def test_the_priority_is_given_back() -> None:
    before = os.sched_getscheduler(0)
    rights.priority(80)
    timing.wake_up(load().control, 0.05)
    assert os.sched_getscheduler(0) == before


def test_wake_ups_are_measured_as_the_loop_sleeps() -> None:
    finding = timing.wake_up(load().control, 0.2)
    values = finding.values
    assert 0 <= values["p50_us"] <= values["p99_us"] <= values["max_us"]
    assert f"p99 {values['p99_us']:.1f} us" in finding.text


def test_a_loop_that_cannot_be_kept_up_with_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    class Late:
        def __init__(self, *arguments: float) -> None: ...

        def wait(self) -> Wake:
            return Wake(0, 900_000, 1)

    monkeypatch.setattr(timing, "Clock", Late)
    finding = timing.wake_up(load().control, 0.1)
    assert finding.verdict is Verdict.FAILED
    assert "100 of 200 cycles missed" in finding.text


def configured(**tables: dict[str, object]) -> Configuration:
    """The default configuration with values that some adapter may bring."""
    configuration = load()
    changed = {
        name: getattr(configuration, name).model_copy(update=values)
        for name, values in tables.items()
    }
    return configuration.model_copy(update=changed)


def test_a_device_on_the_network_is_reached_or_not() -> None:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        port = listener.getsockname()[1]
        terminal = {"host": "127.0.0.1", "port": port}
        there = configured(hardware={"adapter": "festo-cpx"}, festo_cpx=terminal)
        assert device.reachable(there).verdict is Verdict.OK
    gone = device.reachable(there)
    assert gone.verdict is Verdict.FAILED
    for fact in ("127.0.0.1", str(port)):
        assert fact in gone.text
    assert gone.remedy.startswith("ping ")


def on_port(path: str) -> Configuration:
    return configured(hardware={"adapter": "ctrl-p"}, ctrl_p={"device": path})


def test_a_device_file_is_there_and_may_be_opened_or_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    master, slave = os.openpty()
    there = on_port(os.ttyname(slave))
    assert device.reachable(there).verdict is Verdict.OK
    monkeypatch.setattr(device.os, "access", lambda path, mode: False)
    refused = device.reachable(there)
    assert refused.verdict is Verdict.FAILED
    assert "usermod -aG" in refused.remedy
    os.close(master)
    os.close(slave)
    missing = device.reachable(on_port("/dev/none"))
    assert missing.verdict is Verdict.FAILED
    assert "/dev/none" in missing.text


def test_what_is_in_memory_is_reached_and_what_cannot_be_tried_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert device.reachable(load()).verdict is Verdict.OK
    monkeypatch.setattr(device.backends, "location", lambda configuration: Bus("can0/12"))
    told = device.reachable(load())
    assert told.verdict is Verdict.INFO
    assert "can0/12" in told.text


@pytest.mark.parametrize("adapter", ["festo-cpx", "esp32"])
def test_a_device_without_an_address_is_not_looked_for(adapter: str) -> None:
    nowhere = configured(hardware={"adapter": adapter})
    assert device.reachable(nowhere).verdict is Verdict.INFO
    assert "DeviceAllow" not in unit_text(nowhere, None, "ada")


def test_sessions_need_a_disk_with_room(tmp_path: Path) -> None:
    directory = str(tmp_path / "not" / "yet")
    good = places.sessions(configured(log={"directory": directory, "min_free_mib": 0.0}))
    assert good.verdict in (Verdict.OK, Verdict.WARNING)  # a slow disk is no fault of the test
    assert good.values["write_mib_s"] > 0
    assert list(tmp_path.iterdir()) == []
    full = places.sessions(configured(log={"directory": directory, "min_free_mib": 1e12}))
    assert full.verdict is Verdict.FAILED
    nowhere = places.sessions(configured(log={"directory": "/proc/pneuarm"}))
    assert nowhere.verdict is Verdict.FAILED
    assert "cannot be written to" in nowhere.text


def test_the_rings_must_fit_into_shared_memory(tmp_path: Path) -> None:
    assert places.shared_memory(load(), tmp_path / "none").verdict is Verdict.WARNING
    huge = configured(control={"rate_hz": 1e9})
    assert places.shared_memory(huge, tmp_path).verdict is Verdict.FAILED
    small = configured(control={"rate_hz": 50.0})
    assert places.shared_memory(small).values["need_mib"] < 60


def test_the_lock_of_another_daemon_is_told_with_its_process() -> None:
    name = f"doctor-{os.getpid()}"
    own = configured(arm={"name": name})
    assert places.other_daemon(own).verdict is Verdict.OK
    with lock("device", registry.address(own)):
        held = places.other_daemon(own)
    assert held.verdict is Verdict.WARNING
    assert f"(process {os.getpid()})" in held.text
    assert held.remedy.startswith(f"kill {os.getpid()} ")
    assert places.other_daemon(own).verdict is Verdict.OK


def test_a_port_that_is_taken_fails_with_who_to_ask() -> None:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        port = listener.getsockname()[1]
        own = configured(zenoh={"listen": (f"tcp/127.0.0.1:{port}",)}, rerun={"enabled": False})
        taken = places.ports(own)
    assert taken.verdict is Verdict.FAILED
    assert taken.remedy == f"ss -ltnp 'sport = :{port}'"
    assert places.ports(own).verdict is Verdict.OK


def test_a_package_that_is_too_old_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    assert places.packages().verdict is not Verdict.FAILED
    monkeypatch.setattr(places.metadata, "requires", lambda name: ["numpy>=999", "absent>=1"])
    finding = places.packages()
    assert finding.verdict is Verdict.FAILED
    assert "numpy>=999 (found " in finding.text
    assert "absent>=1 (found none)" in finding.text


def test_lines_are_short_and_a_remedy_stays_whole() -> None:
    finding = Finding("check", Verdict.WARNING, "word " * 60, "sudo " + "x" * 200)
    *text, remedy = finding.lines()
    assert all(len(line) <= 100 for line in text)
    assert remedy.strip() == "-> sudo " + "x" * 200
    good = Finding("check", Verdict.OK, "")
    assert summary([good]) == "ready"
    assert summary([good, finding]) == "ready, with 1 warning"
    assert summary([finding, Finding("x", Verdict.FAILED, "")]) == "not ready: 1 failed, 1 warning"


def test_the_command_says_one_finding_a_check_and_its_status(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path)
    done = run_command("doctor", str(daemon.config), "--json")
    told = json.loads(done.stdout)
    assert done.stderr == ""
    assert done.returncode == (0 if told["ready"] else 1)
    checks = [finding["check"] for finding in told["findings"]]
    assert len(checks) == len(set(checks)) == 15
    by_name = {finding["check"]: finding for finding in told["findings"]}
    for name in ("configuration", "arm and device", "ports", "device"):
        assert by_name[name]["verdict"] == "ok", by_name[name]
    assert not daemon.logs.exists()
    page = (ROOT / "docs" / "deployment.md").read_text()
    assert checks == re.findall(r"^\| ([a-z][\w -]+) \| .* \| .* \|$", page, re.M)[1:]


def test_a_terminal_that_lacks_what_the_daemon_asks_for_fails(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text('[hardware]\nadapter = "festo-cpx"\n')
    finding = next(examine(path, None))
    assert (finding.check, finding.verdict) == ("configuration", Verdict.FAILED)
    assert "festo_cpx.host" in finding.text


def test_a_wrong_configuration_is_told_and_the_machine_is_looked_at_all_the_same(
    tmp_path: Path,
) -> None:
    path = tmp_path / "own.toml"
    path.write_text(f"[control]\nrate_hz = 1\n[rerun]\nport = {free_port()}\n")
    done = run_command("doctor", str(path))
    assert done.returncode == 1
    first, second, *_ = done.stdout.splitlines()
    assert first.startswith("failed   configuration ")
    assert "rate_hz" in first + second
    assert "wake-up latency" in done.stdout
    assert "not ready: 1 failed" in done.stdout
    assert done.stderr == ""
