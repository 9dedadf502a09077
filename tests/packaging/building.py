"""Building the distributions and environments with them, without a registry."""

import shutil
import subprocess
import sys
import sysconfig
import zipfile
from dataclasses import dataclass
from email.message import Message
from email.parser import Parser
from importlib import metadata
from pathlib import Path
from typing import TypeAlias

from packaging.requirements import Requirement

from tools.rig.daemon import ROOT

#: Where each distribution is built, in the checkout.
PROJECTS = {"pneuarm-client": "distributions/client", "pneuarm": "."}
_LEFT_OUT = shutil.ignore_patterns(".*", "build", "*.egg-info", "__pycache__", "docs")
_SDIST = "import sys, setuptools.build_meta as b; b.build_sdist(sys.argv[1])"
_SITE = Path(sysconfig.get_path("purelib"))


@dataclass(frozen=True)
class Distribution:
    """One distribution's wheel, and the wheel that comes from its sdist."""

    wheel: Path
    from_sdist: Path


Built: TypeAlias = dict[str, Distribution]


def build_both(folder: Path) -> Built:
    """Build all from a copy, so that nothing of an earlier build is taken along."""
    source = folder / "source"
    shutil.copytree(ROOT, source, symlinks=True, ignore=_LEFT_OUT)
    return {name: _build(source / where, folder / name) for name, where in PROJECTS.items()}


def _build(project: Path, out: Path) -> Distribution:
    # First the sdist: a folder `build` that a wheel leaves behind must not be what makes it whole.
    run(sys.executable, "-c", _SDIST, str(out), cwd=project)
    (sdist,) = out.glob("*.tar.gz")
    return Distribution(_wheel(project, out / "direct"), _wheel(sdist, out / "from_sdist"))


def _wheel(source: Path, out: Path) -> Path:
    _pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(out), str(source))
    (wheel,) = out.glob("*.whl")
    return wheel


def environment(folder: Path, *wheels: Path, packages: Path = _SITE) -> Path:
    """Make an environment with wheels and what lies in ``packages``; return its folder `bin`.

    The folder is only looked into: its `.pth` files, with the editable install, do not count.
    """
    run(sys.executable, "-m", "venv", "--without-pip", str(folder))
    python = folder / "bin" / "python"
    _pip("--python", str(python), "install", "--no-deps", *map(str, wheels))
    (site,) = folder.glob("lib/python*/site-packages")
    (site / "dependencies.pth").write_text(f"{packages}\n")
    return python.parent


def only_what_it_asks_for(wheel: Path, folder: Path) -> Path:
    """Link into a folder what a wheel requires, and what that requires, and nothing else."""
    folder.mkdir()
    waiting = [Requirement(text) for text in _metadata(wheel).get_all("Requires-Dist", [])]
    seen: set[str] = set()
    while waiting:
        requirement = waiting.pop()
        if requirement.name in seen or (requirement.marker and not requirement.marker.evaluate()):
            continue
        seen.add(requirement.name)
        found = metadata.distribution(requirement.name)
        waiting += [Requirement(text) for text in found.requires or []]
        for top in {Path(file).parts[0] for file in found.files or []} - {".."}:
            (folder / top).symlink_to(_SITE / top)
    return folder


def _metadata(wheel: Path) -> "Message[str, str]":
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        return Parser().parsestr(archive.read(name).decode())


def requirements(wheel: Path) -> list[Requirement]:
    """What a wheel requires."""
    return [Requirement(text) for text in _metadata(wheel).get_all("Requires-Dist", [])]


def version(wheel: Path) -> str:
    """Version in a wheel's metadata."""
    return str(_metadata(wheel)["Version"])


def record(wheel: Path) -> dict[str, str]:
    """Every file of a wheel with its hash."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith(".dist-info/RECORD"))
        lines = archive.read(name).decode().splitlines()
    return {file: digest for file, digest, _ in (line.rsplit(",", 2) for line in lines)}


def run(*command: str, cwd: Path | None = None) -> str:
    """Run to the end and return what was printed; what it says if it fails."""
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, (command, done.stdout, done.stderr)
    return done.stdout


def _pip(*arguments: str) -> None:
    run(sys.executable, "-m", "pip", "--disable-pip-version-check", *arguments)
