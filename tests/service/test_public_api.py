"""What `import pneuarm` brings, and what it does not."""

import subprocess
import sys
from pathlib import Path

import pytest

import pneuarm
from tests.service.daemon import ROOT

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
    assert {"pneuarm", "zenoh", "service"} <= loaded
    assert loaded.isdisjoint(HEAVY)


@pytest.mark.parametrize("name", ["service", "logs", "hardware", "controllers"])
@pytest.mark.parametrize("package", [False, True])
def test_module_that_hides_ours_is_named(tmp_path: Path, name: str, package: bool) -> None:
    own = tmp_path / name / "__init__.py" if package else tmp_path / f"{name}.py"
    own.parent.mkdir(exist_ok=True)
    own.write_text("ANSWER = 42\n")
    done = python("import pneuarm", tmp_path)
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"ImportError: pneuarm needs its own package {name!r} from {ROOT}")
    assert str(own) in last
    assert "rename that module, or run from another folder" in last


def test_hidden_package_is_named_by_the_command_too(tmp_path: Path) -> None:
    (tmp_path / "logs.py").write_text("")
    done = python("import runpy; runpy.run_module('pneuarm', run_name='__main__')", tmp_path)
    assert "pneuarm needs its own package 'logs'" in done.stderr.splitlines()[-1]


def test_every_public_name_is_there() -> None:
    for name in pneuarm.__all__:
        assert getattr(pneuarm, name) is not None
    errors = [getattr(pneuarm, name) for name in pneuarm.__all__ if name != "Client"]
    assert all(issubclass(error, pneuarm.PneuarmError) for error in errors)
    assert issubclass(pneuarm.LeaseRefused, pneuarm.ModeRefused)
    assert issubclass(pneuarm.NotConfirmed, pneuarm.DaemonUnreachable)
