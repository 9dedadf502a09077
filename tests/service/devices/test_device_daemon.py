"""A whole daemon on an emulated terminal: whatever dies or stalls, the terminal loses its air."""

import signal
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from pneuarm import Client
from pneuarm.controllers.arm.errors import ModeRefused
from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.rig.daemon import (
    Daemon,
    arm,
    assert_one_sentence,
    enough,
    free_port,
    keep_moving,
    run_command,
    wait_for,
)
from tools.rig.emulators import Emulator


@pytest.fixture
def emulator(tmp_path: Path) -> Iterator[Emulator]:
    with Emulator("festo-cpx", tmp_path) as emulator:
        yield emulator


@pytest.fixture
def daemon(tmp_path: Path, emulator: Emulator) -> Iterator[Daemon]:
    daemon = Daemon(tmp_path, emulator.tables).start()
    try:
        yield daemon
    finally:
        daemon.kill()


def move(daemon: Daemon, emulator: Emulator, seconds: float = 0.5) -> None:
    """Move for a while, so that there is air in the arm."""
    with daemon.client() as client:
        arm(client)
        keep_moving(client, enough(seconds), "some movement")
        assert emulator.zero_since() is None


def is_ready_after_reset(client: Client) -> bool:
    """Ask for a reset where one is due; it may come too early, and then is due again."""
    mode = client.state().mode
    if mode == pb.FAULT:
        with suppress(ModeRefused):
            client.reset()
    return mode == pb.READY


def fault_and_reset(daemon: Daemon, emulator: Emulator, words: str) -> None:
    """See a latched fault with the cause in it, zeros at the terminal, and be ready again."""
    with daemon.client() as client:
        wait_for(lambda: client.state().mode == pb.FAULT, "a fault")
        wait_for(emulator.zero_since, "zeros at the terminal")
        wait_for(
            lambda: any(words in event.cause + event.text for event in client.events()),
            "the event with its cause",
        )
    # Nothing re-arms by itself, and it is ready only through a reset, with the cause gone.
    with daemon.client() as client:
        wait_for(lambda: is_ready_after_reset(client), "the arm to be ready again")
    assert emulator.zero_since() is not None


@pytest.mark.slow
def test_faults_of_transport_and_process_latch_and_are_left_by_reset(
    daemon: Daemon, emulator: Emulator
) -> None:
    move(daemon, emulator)
    daemon.breaks("device")
    emulator.say("unplug 1")
    fault_and_reset(daemon, emulator, "festo_cpx")
    move(daemon, emulator)
    daemon.send_signal_to(daemon.pids("device")["device"], signal.SIGKILL)
    fault_and_reset(daemon, emulator, "device")
    move(daemon, emulator, 0.2)
    control = daemon.pids("control")["control"]
    killed_s = time.monotonic()
    daemon.send_signal_to(control, signal.SIGKILL)
    assert daemon.wait() == 3
    zero_s = emulator.zero_since()
    assert zero_s is not None
    assert zero_s - killed_s < 2.0  # of a busy machine; on a quiet one see the benchmark
    assert "device_restarted" in daemon.codes()


@pytest.mark.slow
def test_a_slow_terminal_costs_the_loop_nothing_and_the_end_of_all_leaves_no_air(
    daemon: Daemon, emulator: Emulator
) -> None:
    emulator.say("slow 20")
    move(daemon, emulator, 1.0)
    with daemon.client() as client:
        assert client.state().mode in (pb.ACTIVE, pb.HOLD)
    daemon.send_signal_to_all(signal.SIGKILL)
    daemon.wait()
    zero_s = wait_for(emulator.zero_since, "the terminal's watchdog")
    last = [change for change in emulator.changes() if change[0] <= zero_s][-1]
    assert last[1] == "watchdog"
    ticks = daemon.log().ticks()
    sent = ticks["pressure_sent_pa"][~np.isnan(ticks["pressure_sent_pa"]).any(axis=(1, 2))]
    assert np.abs(sent).max() > 2000.0
    assert (sent % 100.0 == 0.0).all()  # what the terminal took: whole millibars


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"valves": [0, 1, 1]}, ("festo_cpx.valves", "valve 1 is mapped twice")),
        ({"valves": [0, 1]}, ("2 valves for 3 chambers",)),
        ({"valve_range": "pressure"}, ("festo_cpx.valve_range", "pressure_min_bar = -0.9")),
        ({"ceiling_bar": 0.5}, ("festo_cpx.ceiling_bar", "pressure_max_bar = 0.9")),
        ({"host": ""}, ("festo_cpx.host",)),
        ({"output_base": 65534}, ("festo_cpx.output_base", "65536")),
        ({"watchdog_ms": 0}, ("hardware.accept_no_watchdog",)),
    ],
)
def test_wrong_wiring_is_refused_before_anything_is_started(
    tmp_path: Path, table: dict[str, object], words: tuple[str, ...]
) -> None:
    whole = {"host": "127.0.0.1", "valve_range": "vacuum"} | table
    daemon = Daemon(tmp_path, {"hardware": {"adapter": "festo-cpx"}, "festo_cpx": whole})
    assert_one_sentence(run_command("config", "check", str(daemon.config)), *words)


def test_a_terminal_that_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    table = {"host": "127.0.0.1", "port": free_port(), "valve_range": "vacuum"}
    daemon = Daemon(tmp_path, {"hardware": {"adapter": "festo-cpx"}, "festo_cpx": table})
    done = run_command("run", str(daemon.config))
    assert_one_sentence(done, "festo_cpx", "cannot be reached", "port")


def test_a_terminal_that_takes_no_watchdog_or_lacks_valves_is_refused(
    tmp_path: Path, emulator: Emulator
) -> None:
    for change, words in (
        ({"watchdog_register": 47000}, ("watchdog cannot be set", "festo_cpx.watchdog_register")),
        ({"valves": [0, 1, 7]}, ("no such register",)),
    ):
        tables = emulator.tables | {"festo_cpx": emulator.tables["festo_cpx"] | change}
        done = run_command("run", str(Daemon(tmp_path, tables).config))
        assert_one_sentence(done, *words)
    assert all(not any(setpoints) for _, _, setpoints in emulator.changes())
