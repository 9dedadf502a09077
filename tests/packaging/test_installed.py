"""The distributions installed in environments of their own, and run."""

import json
import os
import subprocess
from pathlib import Path

import pytest

from pneuarm import __version__
from pneuarm.logs.schema import pneuarm_pb2 as pb
from tests.packaging.building import environment, only_what_it_asks_for, run
from tools.rig.daemon import Daemon

_MOVE = """
import sys
from pneuarm import Client
arm, endpoint = sys.argv[1:]
with Client(arm, endpoint) as client:
    client.enable()
    print(client.move_to((0.0, 0.0, 0.21)).reach)
print(*sorted({name.partition(".")[0] for name in sys.modules}))
"""


@pytest.mark.timeout(500)
def test_both_installed_run_the_demo_and_read_its_log(
    wheels: tuple[Path, Path], tmp_path: Path
) -> None:
    programs = environment(tmp_path / "environment", *wheels)
    place = {"cwd": tmp_path, "env": os.environ | {"XDG_STATE_HOME": str(tmp_path / "state")}}
    demo = subprocess.run(
        [programs / "pneuarm", "demo", "--seconds", "5", "--json"],
        capture_output=True,
        text=True,
        timeout=300,
        **place,  # type: ignore[call-overload]
    )
    assert demo.returncode == 0, (demo.stdout, demo.stderr)
    logs = list((tmp_path / "state").rglob("*.mcap"))
    assert logs
    told = json.loads(run(str(programs / "pneuarm"), "info", str(logs[0]), "--json", cwd=tmp_path))
    assert (told["arm"], told["missing_ticks"]) == ("paper", 0)
    program = "import pneuarm; print(pneuarm.__file__)"
    where = run(str(programs / "python"), "-c", program, cwd=tmp_path)
    assert Path(where.strip()).is_relative_to(tmp_path)


@pytest.fixture(scope="module")
def client_alone(wheels: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("client")
    oldest = os.environ.get("CLIENT_PACKAGES")  # of `make test-lowest`
    packages = Path(oldest) if oldest else only_what_it_asks_for(wheels[0], folder / "packages")
    return environment(folder / "environment", wheels[0], packages=packages)


def test_client_alone_moves_a_real_arm(client_alone: Path, tmp_path: Path) -> None:
    with Daemon(tmp_path) as daemon:
        said = run(
            str(client_alone / "python"), "-c", _MOVE, daemon.arm, daemon.endpoint, cwd=tmp_path
        )
    reach, modules = said.splitlines()
    assert int(reach) == pb.REACHED
    assert {"casadi", "osqp", "mcap", "pydantic", "rerun"}.isdisjoint(modules.split())


def test_command_without_the_daemon_says_what_to_install(
    client_alone: Path, tmp_path: Path
) -> None:
    done = subprocess.run(
        [client_alone / "pneuarm", "run"], cwd=tmp_path, capture_output=True, text=True, timeout=30
    )
    assert done.returncode == 1
    assert "pip install ./distributions/client ." in done.stderr
    assert __version__ in done.stderr
    assert len(done.stderr.splitlines()) == 1
