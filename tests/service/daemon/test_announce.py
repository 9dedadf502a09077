"""What the daemon says on its terminal: the facts, warnings, events, no flood."""

import multiprocessing
from dataclasses import asdict
from pathlib import Path

import pytest

from pneuarm.hardware.simulator.parameters import NOMINAL, Valves
from pneuarm.logs.rings.rings import MessageWriter, Rings
from pneuarm.logs.rings.status import RecorderStatus, ViewerStatus
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import EVENT, TARGET
from pneuarm.service.configuration.configuration import check, load
from pneuarm.service.daemon.announce import Announcer, event_line, start_facts
from pneuarm.service.daemon.info import info_of
from pneuarm.service.processes.shared import Shared
from pneuarm.service.processes.usage import ProcessTable

CONTEXT = multiprocessing.get_context("spawn")
NOON_NS = 1_795_348_800_000_000_000


def shared_of(**tables: dict[str, object]) -> Shared:
    whole = load(preset="paper").model_dump()
    for name, table in tables.items():
        whole[name] |= table
    return Shared(
        configuration=check(whole),
        info=pb.Info(log_path=str(Path("/x/session.mcap"))),
        session="s",
        start_ns=0,
        start_unix_ns=0,
        rings=Rings.create(CONTEXT, 1, 50.0),
        recorder=RecorderStatus.create(CONTEXT),
        viewer=ViewerStatus.create(CONTEXT),
        processes=ProcessTable.create(CONTEXT),
    )


def facts(**tables: dict[str, object]) -> list[str]:
    return start_facts(shared_of(**tables), "priority 80 granted, memory locked")


def warnings(lines: list[str]) -> list[str]:
    return [line for line in lines if line.startswith("WARNING")]


def test_every_fact_is_one_line() -> None:
    lines = facts(simulator={"seed": 5, "valves": "itv"})
    assert lines == [
        "arm        paper: 1 section, 3 chambers",
        "adapter    simulator (device simulator:paper, seed 5, itv valves)",
        "rate       1000 Hz, law qp_ik",
        "real time  priority 80 granted, memory locked",
        "zenoh      tcp/127.0.0.1:7447",
        "rerun      rerun+http://127.0.0.1:9876/proxy",
        "log        /x/session.mcap",
    ]


@pytest.mark.parametrize("open_endpoint", ["tcp/0.0.0.0:7448", "tcp/[::]:1", "udp/10.0.0.5:7447"])
def test_listening_to_others_is_a_warning(open_endpoint: str) -> None:
    lines = facts(zenoh={"listen": ["tcp/127.0.0.1:7447", open_endpoint]})
    (warning,) = warnings(lines)
    assert f"listening on {open_endpoint}: anyone on that network can move the arm" in warning


def test_a_view_that_others_can_see_is_a_warning() -> None:
    (warning,) = warnings(facts(rerun={"bind": "0.0.0.0"}))
    assert "Rerun's server listens on 0.0.0.0" in warning
    assert warnings(facts(rerun={"bind": "0.0.0.0", "enabled": False})) == []
    assert "rerun      off" in facts(rerun={"enabled": False})


class FakeTime:
    """Seconds as the test has them."""

    def __init__(self) -> None:
        self.now_s = 10.0

    def monotonic(self) -> float:
        return self.now_s


class Terminal:
    """Announcer with its rings, its lines and a clock."""

    def __init__(self, clock: FakeTime) -> None:
        self.clock = clock
        self.lines: list[str] = []
        rings = Rings.create(CONTEXT, 1, 50.0)
        self._writers = [MessageWriter(memory) for memory in rings.messages()]
        self._announcer = Announcer(rings, self.lines.append)

    def tell(self, text: str, level: "pb.Level" = pb.WARNING, code: str = "rejected") -> None:
        event = pb.Event(text=text, level=level, code=code, source="gateway")
        self._writers[len(text) % 3].write(EVENT, event, NOON_NS)

    def write_target(self) -> None:
        self._writers[1].write(TARGET, pb.Target(), NOON_NS)

    def step(self) -> list[str]:
        """The lines that are new."""
        self.lines.clear()
        self._announcer.step()
        return self.lines


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    clock = FakeTime()
    monkeypatch.setattr("pneuarm.service.daemon.announce.time", clock)
    return Terminal(clock)


def test_events_of_every_process_are_said_once(terminal: Terminal) -> None:
    for text in ("a", "bb", "ccc"):
        terminal.tell(text)
    terminal.write_target()
    assert {line.split(": ")[1] for line in terminal.step()} == {"a", "bb", "ccc"}
    assert terminal.step() == []


def test_the_priority_is_not_said_twice(terminal: Terminal) -> None:
    terminal.tell("priority granted", code="realtime")
    assert terminal.step() == []


def test_a_flood_of_events_is_no_flood_of_lines(terminal: Terminal) -> None:
    for _ in range(500):
        terminal.tell("bad message")
    assert len(terminal.step()) == 10
    terminal.clock.now_s += 0.5
    terminal.tell("bad message")
    assert terminal.step() == []
    terminal.clock.now_s += 1.0
    terminal.tell("another")
    lines = terminal.step()
    assert "491" in lines[0]
    assert "in the log" not in lines[0]  # which the recorder may not have written
    assert lines[1].endswith("another")
    terminal.clock.now_s += 1.0
    terminal.tell("later")
    assert len(terminal.step()) == 1


def test_an_error_is_said_in_the_middle_of_a_flood(terminal: Terminal) -> None:
    for _ in range(500):
        terminal.tell("bad message")
    terminal.step()
    terminal.tell("fault: the arm vents", pb.ERROR, "fault")
    (line,) = terminal.step()
    assert "error" in line
    assert "fault: the arm vents" in line


def test_an_event_is_one_line_with_cause_and_remedy() -> None:
    event = pb.Event(
        time_unix_ns=NOON_NS + 123_000_000,
        level=pb.ERROR,
        source="control",
        text="fault: the arm vents",
        client_id="me",
        cause="a leak",
        remedy="reset",
    )
    expected = "12:00:00.123 error   control: fault: the arm vents [me] (cause: a leak) -> reset"
    assert event_line(event) == expected
    bare = pb.Event(time_unix_ns=NOON_NS, level=pb.INFO, source="gateway", text="hello")
    assert event_line(bare) == "12:00:00.000 info    gateway: hello"


@pytest.mark.parametrize("valves", NOMINAL)
def test_the_facts_of_a_session_hold_what_its_valves_were_drawn_from(valves: Valves) -> None:
    """By the names of their own parameters, with the nominal ones; the name is in the file's."""
    configuration = check(load().model_dump(exclude_none=True) | {"simulator": {"valves": valves}})
    info = info_of(configuration, configuration.build_arm(), "/x/session.mcap")
    assert f'valves = "{valves}"' in info.config_toml
    for name, nominal in asdict(NOMINAL[valves]).items():
        assert info.simulator[f"nominal_{name}"] == nominal
        if name != "lowest_mode_hz":
            assert 0.8 * nominal <= info.simulator[name] <= 1.2 * nominal
