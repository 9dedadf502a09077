"""One daemon an arm and a device: across processes, namespaces and users, and however it ends."""

import multiprocessing
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pneuarm.controllers.arm.errors import AlreadyInUse, ConfigurationError
from pneuarm.service.processes import lock as locks
from pneuarm.service.processes.lock import Lock, lock
from tools.rig.daemon import ROOT

NAME = f"test-lock-{os.getpid()}"


def test_a_second_lock_is_refused_with_the_process_that_holds_it() -> None:
    with lock("device", NAME):
        with pytest.raises(ConfigurationError) as caught:
            lock("device", NAME)
        for fact in ("device", repr(NAME), f"process {os.getpid()}"):
            assert fact in str(caught.value)
        lock("device", NAME + "-2").close()
        lock("arm", NAME).close()  # the two kinds are apart
    lock("device", NAME).close()


HOLD_A_LOCK = """
import sys
from pneuarm.service.processes.lock import lock
held = lock("device", sys.argv[1])
print(flush=True)
sys.stdin.read()
"""


def test_the_lock_of_another_process_is_seen_and_goes_with_it_however_it_ends() -> None:
    other = subprocess.Popen(
        [sys.executable, "-c", HOLD_A_LOCK, NAME], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert other.stdout is not None
    assert other.stdin is not None
    other.stdout.readline()
    with pytest.raises(ConfigurationError, match=rf"\(process {other.pid}\)"):
        lock("device", NAME)
    other.kill()
    other.wait()
    lock("device", NAME).close()
    other.stdin.close()
    other.stdout.close()


def test_the_lock_does_not_leak_into_programs_that_are_started() -> None:
    held = lock("device", NAME)
    assert not os.get_inheritable(held.fileno())
    held.close()


def _other_namespace() -> list[str]:
    """Begin of a command in a network namespace of its own, empty where none may be made."""
    for words in (["unshare", "-n"], ["unshare", "-r", "-n"]):
        made = shutil.which("unshare") and subprocess.run([*words, "true"], capture_output=True)
        if made and made.returncode == 0:
            return words
    return []


def test_a_daemon_in_another_network_namespace_is_seen() -> None:
    namespace = _other_namespace()
    if not namespace:
        pytest.skip("no network namespace may be made here")
    program = (
        "import sys; from pneuarm.service.processes.lock import lock; lock('arm', sys.argv[1])"
    )
    words = [*namespace, sys.executable, "-c", program, NAME]
    with lock("arm", NAME):
        done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=30)
    assert done.returncode == 1
    assert "AlreadyInUse" in done.stderr
    assert str(os.getpid()) in done.stderr
    assert subprocess.run(words, cwd=ROOT, timeout=30).returncode == 0


def _hold(held: Lock, taken: "multiprocessing.synchronize.Event", until: object) -> None:
    taken.set()
    until.wait(30)  # type: ignore[attr-defined]


def test_a_process_that_was_handed_the_lock_holds_it_after_who_took_it() -> None:
    context = multiprocessing.get_context("spawn")
    taken, until = context.Event(), context.Event()
    held = lock("arm", NAME)
    child = context.Process(target=_hold, args=(held, taken, until))
    child.start()
    assert taken.wait(30)
    held.close()
    with pytest.raises(AlreadyInUse):
        lock("arm", NAME)
    until.set()
    child.join(30)
    lock("arm", NAME).close()


@pytest.mark.parametrize("name", ["serial:/dev/serial/by-id/x", "x" * 5000, "\udcff", "a\nb", ""])
def test_whatever_a_device_is_called_it_can_be_locked(name: str) -> None:
    with lock("device", name), pytest.raises(AlreadyInUse):
        lock("device", name)


def test_where_no_file_can_be_made_nothing_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(locks, "_PLACES", (tmp_path / "file" / "none",))
    with pytest.raises(ConfigurationError, match=r"none.*two daemons"):
        lock("arm", NAME)
