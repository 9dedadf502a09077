"""The documents against the project: tables are fresh, what is named exists, commands parse."""

import ast
import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.workspace.workspace import Workspace
from pneuarm.hardware.device import Device, EmulatedDevice
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import ALIVE_CLIENT, ALIVE_DAEMON, TOPICS
from pneuarm.service.cli.parser import build_parser
from pneuarm.service.cli.text import outcome
from pneuarm.service.configuration.configuration import load
from pneuarm.service.configuration.devices import AnyDevice, devices
from pneuarm.service.monitors.fault import Policy
from tools.docs import configuration, messages
from tools.docs.pages import PAGES, ROOT, fresh
from tools.docs.regions import names
from tools.docs.tables import PACKAGES
from tools.faults.report import BEGIN, END

DOCS = ROOT / "docs"
BY_NAME = {page.name: page for page in PAGES}
each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


def section(page: str, heading: str) -> str:
    """Text of a page below a heading, up to the next one."""
    text = (DOCS / page).read_text()
    found = re.search(rf"^#+ {re.escape(heading)}\n(.*?)(?=^#+ |\Z)", text, re.M | re.S)
    assert found, f"{page} has no heading {heading!r}"
    return found[1]


def first_cells(text: str) -> set[str]:
    """Everything in backticks in the first column of the tables in a text."""
    lines = (line for line in text.splitlines() if line.startswith("|"))
    return {name for line in lines for name in re.findall(r"`([^`]+)`", line.split("|")[1])}


def table_rows(text: str) -> dict[str, list[str]]:
    """Cells of the rows of the tables in a text, by every name in backticks in their first."""
    lines = (line[1:-1] for line in text.splitlines() if line.startswith("|"))
    cells = ([cell.strip() for cell in line.split("|")] for line in lines)
    return {name: row for row in cells for name in re.findall(r"`([^`]+)`", row[0])}


def code_blocks(page: Path, language: str) -> list[str]:
    """Code blocks of a language on a page."""
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.M | re.S)


def prose(page: Path) -> str:
    """Return a page without its fenced code blocks."""
    return re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S)


# --- what is made from the code ------------------------------------------------------------------


@each_page
def test_no_table_is_stale(page: Path) -> None:
    text = page.read_text()
    assert fresh(text) == text, f"{page.name} is stale: run `make docs`"


def test_every_table_of_the_configuration_has_its_place() -> None:
    text = (DOCS / "configuration.md").read_text()
    places = (name for name in names(text) if name.startswith("configuration "))
    described = [path for name in places for path in configuration.covered(name)]
    assert sorted(described) == sorted(configuration.tables())


@pytest.mark.parametrize("path", sorted(configuration.tables()))
def test_every_key_says_what_it_means(path: str) -> None:
    model = configuration.tables()[path]
    silent = [
        key
        for key, field in model.model_fields.items()
        if not field.description and f"{path}.{key}".lstrip(".") not in configuration.tables()
    ]
    assert not silent, f"{model.__name__}: give each of these a description"


def test_every_message_has_its_place() -> None:
    text = (DOCS / "wire.md").read_text()
    assert {f"message {name}" for name in messages.messages()} <= set(names(text))


@pytest.mark.parametrize(
    "name", ["keys", "enums", "codes", "modes", "faults", "monitors", "exceptions"]
)
def test_every_other_table_has_one_place(name: str) -> None:
    assert [name for page in PAGES for found in names(page.read_text()) if found == name] == [name]


# --- what is written by hand ---------------------------------------------------------------------


@pytest.mark.parametrize(
    "message",
    {
        topic.message.DESCRIPTOR: None  # in order, each once: two workers must collect the same
        for topic in TOPICS
        if topic.message is not None and topic.message.DESCRIPTOR.full_name.startswith("foxglove")
    },
    ids=lambda message: message.name,
)
def test_the_fields_of_foxgloves_messages_are_named(message) -> None:
    fields = {field.name for field in message.fields}
    assert first_cells(section("wire.md", f"`{message.full_name}`")) == fields


def test_the_liveliness_tokens_are_named() -> None:
    keys = first_cells(section("wire.md", "Keys"))
    assert {ALIVE_DAEMON, f"{ALIVE_CLIENT}/<client_id>"} <= keys


def test_every_policy_is_described() -> None:
    policies = section("safety.md", "What a fault does")
    assert {policy.name.lower() for policy in Policy} <= set(
        re.findall(r"^\| (\w+)", policies, re.M)
    )


def test_there_is_one_place_for_the_campaign() -> None:
    text = (DOCS / "safety.md").read_text()
    assert text.count(BEGIN) == text.count(END) == 1
    assert text.index(BEGIN) < text.index(END)


@pytest.mark.parametrize("device", devices().usable.values(), ids=lambda device: device.name)
def test_what_every_device_leaves_in_the_arm_is_described(device: AnyDevice) -> None:
    watchdog = table_rows(section("hardware.md", "Which device has a watchdog"))[device.name][1]
    assert (watchdog == "no") == bool(device.left_behind(device.config()))


def test_every_member_of_a_kind_of_device_is_described() -> None:
    described = " ".join(first_cells(section("hardware.md", "Write your own adapter")))
    members = [name for name in {**vars(Device), **vars(EmulatedDevice)} if name[0] != "_"]
    left_alone = {"table", "never_waits"}  # follows from the name; of what is in memory only
    own = {"name", "summary", "config", *members} - left_alone
    assert [name for name in sorted(own) if name not in described] == []


def test_the_test_of_a_device_of_your_own_is_the_examples() -> None:
    (block,) = code_blocks(DOCS / "hardware.md", "python")
    example = ast.parse((ROOT / "examples/device/tests/test_contract.py").read_text())
    for node in ast.walk(example):
        if isinstance(node, ast.ClassDef | ast.Module):
            node.body = [part for part in node.body if not _is_docstring(part)]
    assert ast.dump(ast.parse(block)) == ast.dump(example)


def _is_docstring(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def test_the_worked_example_is_a_good_configuration(tmp_path: Path) -> None:
    (example,) = code_blocks(DOCS / "configuration.md", "toml")
    path = tmp_path / "bench.toml"
    path.write_text(example)
    assert len(load(path).arm.sections) == 2


@each_page
def test_python_on_a_page_compiles(page: Path) -> None:
    for block in code_blocks(page, "python"):
        compile(block, page.name, "exec")


@pytest.mark.parametrize("package", PACKAGES)
def test_the_drawing_of_the_house_has_the_floors_of_the_contracts(package: str) -> None:
    (drawing,) = re.findall(
        rf"^    {package} (.*?)(?=^    -----|^$)",
        (DOCS / "architecture.md").read_text(),
        re.M | re.S,
    )
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    (layers,) = (
        contract["layers"]
        for contract in settings["contracts"]
        if contract.get("containers") == [f"pneuarm.{package}"]
    )
    drawn = [set(re.findall(r"\w+", row)) for row in drawing.strip().splitlines()]
    assert drawn == [set(re.findall(r"\w+", layer)) for layer in layers]


# --- what is named exists ------------------------------------------------------------------------

#: Files and folders of the project itself, as a page names them; also with wildcards.
TOP = ("controllers", "hardware", "logs", "service", "tests", "tools", "docs", "examples")
PATH = re.compile(rf"`((?:{'|'.join(TOP)})/[\w./*-]*)`")
#: Files of the project without their folder, also with wildcards.
FILE = re.compile(r"`([\w*?\[\]-]+\.(?:py|toml|proto|md|lock|csv))`")
#: Files that a page tells the reader to make.
OWN = {"bench.toml", "calibration.toml", "pneuarm.toml"}
#: Folder of the files that a table names, in the heading of its first column.
FOLDER = re.compile(r"^\| file in `([\w/]+)/` \|.*\n(?:\|.*\n)+", re.M)


@each_page
def test_every_path_that_is_named_exists(page: Path) -> None:
    for name in PATH.findall(page.read_text()):
        assert list(ROOT.glob(name.rstrip("/"))), f"{name} does not exist"
    for name in set(FILE.findall(page.read_text())) - OWN:
        here = [*ROOT.glob(name), *(found for top in TOP for found in (ROOT / top).rglob(name))]
        assert here, f"no {name}"


def test_every_file_in_the_table_of_a_folder_is_in_that_folder_and_none_is_left_out() -> None:
    tables = [found for page in PAGES for found in FOLDER.finditer(page.read_text())]
    assert tables
    for found in tables:
        folder, rows = ROOT / found[1], found[0].partition("\n")[2]
        named = first_cells(rows)
        assert all((folder / name).exists() for name in named), f"{found[1]}: {named}"
        modules = {path.name for path in folder.glob("*.py")} - {"__init__.py"}
        assert modules <= named


@each_page
def test_every_relative_link_resolves(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        linked = (page.parent / name).resolve() if name else page
        assert linked.is_relative_to(ROOT), f"{target} leads out of the project"
        assert linked.exists(), f"{target} does not exist"
        if anchor:
            assert anchor in anchors(linked), f"{name} has no heading for #{anchor}"


def anchors(path: Path) -> set[str]:
    """Names under which the headings of a page are linked to."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in headings}


@each_page
def test_no_page_names_a_path_of_a_machine(page: Path) -> None:
    text = page.read_text()
    assert str(ROOT) not in text
    assert str(Path.home()) not in text or str(Path.home()) == "/"
    assert not re.search(r"(?<![\w.~])/(home|root|work|Users|tmp)/", text)


@each_page
def test_every_make_target_that_is_named_exists(page: Path) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.M))
    named = re.findall(r"(?:`|^ {4}(?:\$ )?)make ([a-z][a-z-]*)", page.read_text(), re.M)
    assert set(named) <= targets


#: A command in a block of code, without its comment and without what it is piped into.
COMMAND = re.compile(r"^(?: {4})?(?:\$ )?(?:\.venv/bin/)?(pneuarm [a-z][^|#\n]*)", re.M)
#: The beginning of one within a sentence.
MENTION = re.compile(r"`pneuarm ([a-z]+)")


@each_page
def test_every_command_in_a_block_of_code_parses(
    page: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    blocks = re.findall(r"^(?: {4}.*| *)$", prose(page), re.M) + code_blocks(page, "(?:sh|bash)?")
    for command in COMMAND.findall("\n".join(blocks)):
        words = shlex.split(re.sub(r"[\[\]]", "", command))[1:]
        try:
            build_parser().parse_args(words)
        except SystemExit:
            pytest.fail(f"{command}: {capsys.readouterr().err}")


@each_page
def test_every_command_in_a_sentence_exists(page: Path) -> None:
    help_text = build_parser().format_help()
    for command in MENTION.findall(page.read_text()):
        assert re.search(rf"^ +{command}\b", help_text, re.M), f"there is no `pneuarm {command}`"


# --- what the README shows is what the program says ----------------------------------------------


def shown(command: str) -> str:
    """Return the line that the README shows below a command."""
    lines = (ROOT / "README.md").read_text().splitlines()
    return lines[lines.index(f"    $ pneuarm {command}") + 1].strip()


def numbers(text: str) -> list[float]:
    return [float(value) for value in re.findall(r"-?\d+\.\d+", text)]


def test_a_target_within_and_one_out_of_reach_end_as_the_readme_shows() -> None:
    near = shown("send position 60 20 190 --enable")
    x, y, z, error = numbers(near)
    reached = pb.ArmState(reach=pb.REACHED, target_error_m=1e-3 * error)
    reached.tip_estimated_position_m.extend(1e-3 * value for value in (x, y, z))
    assert near == f"{outcome(reached)}; the arm holds"

    command = "send position 300 0 100 --enable"
    answer = Workspace(load(preset="paper").build_arm()).is_reachable(np.array([0.3, 0.0, 0.1]))
    away = pb.ArmState(reach=pb.OUT_OF_REACH, binding_limits=answer.limits)
    away.target_error_m = answer.distance_m
    away.tip_commanded_position_m.extend(answer.nearest_m)
    there = f"{outcome(away)}; the arm holds"
    assert re.sub(r"-?\d+\.\d+", "", shown(command)) == re.sub(r"-?\d+\.\d+", "", there)
    assert numbers(shown(command)) == pytest.approx(numbers(there), abs=0.15)


@each_page
def test_commands_are_written_for_the_activated_environment(page: Path) -> None:
    assert not re.search(r"\.venv/bin/(?!activate)", page.read_text())
