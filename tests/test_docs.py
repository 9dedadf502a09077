"""The documents against the code: keys and fields are described, references resolve."""

import ast
import re
from pathlib import Path

import pytest
from annotated_types import Ge, Gt, Le, Lt
from google.protobuf.descriptor import Descriptor
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from pneuarm.hardware.device import Device, EmulatedDevice
from pneuarm.hardware.simulator.parameters import SimulatorParameters
from pneuarm.hardware.tables import arm
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import ALIVE_CLIENT, ALIVE_DAEMON, TOPICS
from pneuarm.service.configuration import configuration as config
from pneuarm.service.configuration.devices import AnyDevice, devices
from pneuarm.service.configuration.tables import (
    control,
    feedback,
    frames,
    hardware,
    monitors,
    outputs,
)
from pneuarm.service.modes.mode import TABLE, Mode, ModeEvent

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PAGES = sorted([*ROOT.glob("*.md"), *DOCS.rglob("*.md")])

#: Heading of every table of the configuration, and the model that reads it.
TABLES: dict[str, type[BaseModel]] = {
    "Top level": config.Configuration,
    "`[arm]`": arm.ArmConfig,
    "`[arm.response]`": arm.ResponseConfig,
    "`[[arm.sections]]`": arm.SectionConfig,
    "`[[arm.keep_outs]]`": arm.KeepOutConfig,
    "`[control]`": control.ControlConfig,
    "`[reference]`": feedback.ReferenceConfig,
    "`[feedback]`": feedback.FeedbackConfig,
    "`[frames]`": frames.FramesConfig,
    "`[hardware]`": hardware.HardwareConfig,
    "`[monitors]`": monitors.MonitorsConfig,
    **{f"`[{device.table}]`": device.config for device in devices().usable.values()},
    "`[zenoh]`": outputs.ZenohConfig,
    "`[rerun]`": outputs.RerunConfig,
    "`[log]`": outputs.LogConfig,
}
KEYS = [(heading, key) for heading, model in TABLES.items() for key in model.model_fields]

MESSAGES = [
    *pb.DESCRIPTOR.message_types_by_name.values(),
    *{
        topic.message.DESCRIPTOR.full_name: topic.message.DESCRIPTOR
        for topic in TOPICS
        if topic.message is not None and topic.message.DESCRIPTOR.file is not pb.DESCRIPTOR
    }.values(),
]


def section(page: str, heading: str) -> str:
    """Text of a page below a heading, up to the next one."""
    text = (DOCS / page).read_text()
    found = re.search(rf"^#+ {re.escape(heading)}\n(.*?)(?=^#+ |\Z)", text, re.M | re.S)
    assert found, f"{page} has no heading {heading!r}"
    return found[1]


def rows(text: str) -> dict[str, list[str]]:
    """Rows of the tables in a text, by every name in backticks in their first column."""
    found = {}
    for line in text.splitlines():
        if line.startswith("|"):
            cells = [cell.strip() for cell in line[1:-1].split("|")]
            found |= dict.fromkeys(re.findall(r"`([^`]+)`", cells[0]), cells)
    return found


def code_blocks(page: str, language: str) -> list[str]:
    """Code blocks of a language on a page."""
    return re.findall(rf"^```{language}\n(.*?)^```", (DOCS / page).read_text(), re.M | re.S)


def anchors(path: Path) -> set[str]:
    """Names under which the headings of a page are linked to."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in headings}


def models_below(model: type[BaseModel]) -> set[type[BaseModel]]:
    """Return a model and all models in its fields."""
    found = {model}
    for field in model.model_fields.values():
        inner = [field.annotation, *getattr(field.annotation, "__args__", ())]
        for candidate in inner:
            if isinstance(candidate, type) and issubclass(candidate, BaseModel):
                found |= models_below(candidate)
    return found


def test_every_table_of_the_configuration_is_looked_at() -> None:
    assert set(TABLES.values()) == models_below(config.Configuration)


@pytest.mark.parametrize(("heading", "key"), KEYS)
def test_every_key_is_described_with_its_default_and_bounds(heading: str, key: str) -> None:
    field = TABLES[heading].model_fields[key]
    cells = rows(section("configuration.md", heading))[key]
    default, allowed = cells[2].strip('"'), cells[3]
    if field.default is PydanticUndefined:
        assert default in ("required", "from the preset")
    elif not isinstance(field.default, BaseModel):
        expected = str(field.default).replace("'", '"')
        if isinstance(field.default, tuple):  # TOML writes a list
            expected = expected.replace(",)", ")").replace("(", "[").replace(")", "]")
        assert default == (expected.lower() if isinstance(field.default, bool) else expected)
    for bound in field.metadata:
        for kind, name in ((Ge, "ge"), (Gt, "gt"), (Le, "le"), (Lt, "lt")):
            if isinstance(bound, kind):
                number = getattr(bound, name)
                assert re.search(rf"(?<![\d.]){number:.10g}(?![\d.]\d)", allowed) or (
                    number == 0 and "0 or more" in allowed
                ), f"{key}: {bound} is not in {allowed!r}"


@pytest.mark.parametrize("heading", TABLES)
def test_no_key_is_described_that_does_not_exist(heading: str) -> None:
    assert set(rows(section("configuration.md", heading))) == set(TABLES[heading].model_fields)


@pytest.mark.parametrize("device", devices().usable.values(), ids=lambda device: device.name)
def test_what_every_device_leaves_in_the_arm_is_described(device: AnyDevice) -> None:
    watchdog = rows(section("hardware.md", "Which device has a watchdog"))[device.name][1]
    assert (watchdog == "no") == bool(device.left_behind(device.config()))


def test_every_member_of_a_kind_of_device_is_described() -> None:
    described = " ".join(rows(section("hardware.md", "Write your own adapter")))
    members = [name for name in {**vars(Device), **vars(EmulatedDevice)} if name[0] != "_"]
    left_alone = {"table", "never_waits"}  # follows from the name; of what is in memory only
    own = {"name", "summary", "config", *members} - left_alone
    assert [name for name in sorted(own) if name not in described] == []


def test_the_test_of_a_device_of_your_own_is_the_examples() -> None:
    (block,) = code_blocks("hardware.md", "python")
    example = ast.parse((ROOT / "examples/device/tests/test_contract.py").read_text())
    for node in ast.walk(example):
        if isinstance(node, ast.ClassDef | ast.Module):
            node.body = [part for part in node.body if not _is_docstring(part)]
    assert ast.dump(ast.parse(block)) == ast.dump(example)


def _is_docstring(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


@pytest.mark.parametrize("preset", config.PRESETS)
def test_the_built_in_arms_are_described_as_they_are(preset: str) -> None:
    table = rows(section("configuration.md", "The built-in arms"))
    column = ["paper", "table1", "trunk"].index(preset) + 1
    loaded = config.load(None, preset)
    for key in set(table) & set(arm.SectionConfig.model_fields):
        values = {f"{getattr(part, key):g}" for part in loaded.arm.sections}
        assert values == {table[key][column].removesuffix(" each")}
    assert table["rate_hz"][column] == f"{loaded.control.rate_hz:g}"


def test_the_worked_example_is_a_good_configuration(tmp_path: Path) -> None:
    (example,) = code_blocks("configuration.md", "toml")
    path = tmp_path / "bench.toml"
    path.write_text(example)
    assert len(config.load(path).arm.sections) == 2


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.key)
def test_every_key_of_the_wire_is_described_with_its_message_and_rate(topic) -> None:
    cells = rows(section("wire.md", "Keys"))[topic.key]
    if topic.message is not None:
        assert topic.message.DESCRIPTOR.full_name.removeprefix("pneuarm.") in cells[2]
    if topic.rate_hz is not None:
        assert f"{topic.rate_hz:g} Hz" in cells[3]


def test_the_liveliness_tokens_are_described() -> None:
    assert {ALIVE_DAEMON, f"{ALIVE_CLIENT}/<client_id>"} <= set(rows(section("wire.md", "Keys")))


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: message.full_name)
def test_every_field_of_every_message_is_described_and_no_other(message: Descriptor) -> None:
    name = message.full_name.removeprefix("pneuarm.")
    described = set(rows(section("wire.md", f"`{name}`")))
    assert described == {field.name for field in message.fields}


@pytest.mark.parametrize("enum", pb.DESCRIPTOR.enum_types_by_name.values(), ids=lambda e: e.name)
def test_every_value_of_every_enum_is_described_with_its_number(enum) -> None:
    described = rows(section("wire.md", "Messages"))[enum.name][1]
    for value in enum.values:
        assert f"{value.number} `{value.name}`" in described


def test_the_code_blocks_compile() -> None:
    blocks = code_blocks("wire.md", "python")
    assert blocks
    for block in blocks:
        compile(block, "docs/wire.md", "exec")


@pytest.mark.parametrize("name", SimulatorParameters.__dataclass_fields__)
def test_every_parameter_of_the_simulated_arm_is_described_with_its_value(name: str) -> None:
    assert rows(section("simulator.md", "Parameters"))[name][1] == str(
        getattr(SimulatorParameters(), name)
    )


@pytest.mark.parametrize("event", ModeEvent, ids=lambda event: event.name)
def test_the_table_of_modes_is_the_one_of_the_code(event: ModeEvent) -> None:
    cells = rows(section("architecture.md", "Modes"))[event.name][2:]
    for mode, cell in zip(Mode, cells, strict=True):
        after = TABLE.get((mode, event))
        assert cell == ("" if after is None else after.name.lower())


def test_every_event_code_of_the_modes_is_described() -> None:
    text = section("wire.md", "`Event`")
    for event in ModeEvent:
        assert f"`{event.name.lower()}`" in text


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_no_page_names_a_path_of_a_machine(page: Path) -> None:
    text = page.read_text()
    assert str(ROOT) not in text
    assert str(Path.home()) not in text or str(Path.home()) == "/"
    assert not re.search(r"(?<![\w.~])/(home|root|work|Users|tmp)/", text)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
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


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_file_of_the_project_that_is_named_exists(page: Path) -> None:
    named = r"`((?:controllers|hardware|logs|service|tests|docs)/[\w./]+)`"
    for name in re.findall(named, page.read_text()):
        assert (ROOT / name).exists(), f"{name} does not exist"
