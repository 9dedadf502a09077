"""What is in which distribution."""

import sys
from pathlib import Path

import pytest

import pneuarm
from tests.packaging.building import PROJECTS, Built, record, requirements, version
from tools.rig.daemon import ROOT


def test_no_file_is_in_both(built: Built) -> None:
    client, daemon = (set(record(built[name].wheel)) for name in ("pneuarm-client", "pneuarm"))
    assert client.isdisjoint(daemon)


@pytest.mark.parametrize("name", PROJECTS)
def test_wheel_from_the_sdist_is_the_same(built: Built, name: str) -> None:
    def files(wheel: Path) -> dict[str, str]:
        """Everything but the list of files itself, which holds no hash of its own."""
        return {file: digest for file, digest in record(wheel).items() if digest}

    assert files(built[name].wheel) == files(built[name].from_sdist)


def test_together_they_hold_every_source_file(built: Built) -> None:
    shipped = {name for each in built.values() for name in record(each.wheel)}
    rooms = ("controllers", "hardware", "logs", "service")
    here = {f"pneuarm/{path.relative_to(ROOT)}" for room in rooms for path in _sources(ROOT / room)}
    here |= {f"pneuarm/{path.name}" for path in (ROOT / "pneuarm").glob("*.py")}
    assert {name for name in shipped if ".dist-info/" not in name} == here | {"pneuarm/py.typed"}


def _sources(folder: Path) -> list[Path]:
    kinds = (".py", ".pyi", ".proto", ".toml", ".service", ".csv")
    return [path for path in folder.rglob("*") if path.suffix in kinds]


def test_they_have_one_version_and_the_daemon_asks_for_that_client(built: Built) -> None:
    assert {version(each.wheel) for each in built.values()} == {pneuarm.__version__}
    (client,) = (
        asked for asked in requirements(built["pneuarm"].wheel) if asked.name == "pneuarm-client"
    )
    assert str(client.specifier) == f"=={pneuarm.__version__}"


def test_client_asks_for_nothing_that_the_daemon_does_not_bear(built: Built) -> None:
    daemon = {asked.name: asked for asked in requirements(built["pneuarm"].wheel)}
    for asked in requirements(built["pneuarm-client"].wheel):
        assert asked.name in daemon, f"{asked.name} is in the client's environments alone"
        assert not [each for each in asked.specifier if each.operator != ">="], asked


def test_interpreter_of_the_tests_is_one_that_both_support() -> None:
    assert sys.version_info >= (3, 11)
