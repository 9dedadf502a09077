"""What `import pneuarm` brings, and what it does not."""

import subprocess
import sys
from pathlib import Path

import pytest

import pneuarm
from pneuarm.controllers.arm import errors
from tools.rig.daemon import ROOT

HEAVY = ("casadi", "osqp", "rerun", "mcap", "pydantic", "scipy")


def python(code: str, cwd: Path) -> "subprocess.CompletedProcess[str]":
    """Run a user's program in its own folder."""
    return subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.append({str(ROOT)!r})\n{code}"],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=30,
    )


def test_importing_the_client_loads_nothing_heavy(tmp_path: Path) -> None:
    done = python("from pneuarm import Client\nprint(*sys.modules)", tmp_path)
    assert done.returncode == 0, done.stderr
    loaded = {name.partition(".")[0] for name in done.stdout.split()}
    assert {"pneuarm", "zenoh"} <= loaded
    assert loaded.isdisjoint(HEAVY)


@pytest.mark.parametrize("name", ["service", "logs", "hardware", "controllers"])
@pytest.mark.parametrize("package", [False, True])
def test_modules_of_the_users_own_change_nothing(tmp_path: Path, name: str, package: bool) -> None:
    own = tmp_path / name / "__init__.py" if package else tmp_path / f"{name}.py"
    own.parent.mkdir(exist_ok=True)
    own.write_text("ANSWER = 42\n")
    code = f"import {name}, pneuarm, pneuarm.{name}\nprint({name}.ANSWER, pneuarm.Client.__name__)"
    done = python(code, tmp_path)
    assert (done.returncode, done.stdout) == (0, "42 Client\n"), done.stderr


def test_folder_called_logs_changes_nothing(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    code = "import runpy, sys\nsys.argv = ['pneuarm', 'config', 'show']\n"
    done = python(code + "runpy.run_module('pneuarm', run_name='__main__')", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "[arm]" in done.stdout


def test_every_public_name_is_there() -> None:
    for name in pneuarm.__all__:
        assert getattr(pneuarm, name) is not None


def test_every_exception_of_the_tree_is_public() -> None:
    tree = {name for name, value in vars(errors).items() if isinstance(value, type)}
    assert tree == set(pneuarm.__all__) - {"Client", "__version__"}
    assert all(issubclass(getattr(pneuarm, name), pneuarm.PneuarmError) for name in tree)


def test_what_is_no_failure_of_the_connection_is_not_told_as_one() -> None:
    for error in (pneuarm.MoveTimeout, pneuarm.NotConfirmed, pneuarm.MessageRejected):
        assert not issubclass(error, pneuarm.DaemonUnreachable)
    assert not issubclass(pneuarm.MoveTimeout, pneuarm.NotConfirmed)  # of a stop alone
