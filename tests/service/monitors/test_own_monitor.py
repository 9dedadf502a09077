"""A monitor costs its class and its place in the list: this file alone defines one."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any

import pytest
from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.tables.table import BAR, Positive, Table
from pneuarm.service.monitors.fault import Fault, Policy
from pneuarm.service.monitors.monitor import Monitor, Observation, bar

ROOT = Path(__file__).resolve().parents[3]


class SupplyHighKeys(Table):
    """When the supply is too high."""

    highest_bar: Annotated[Positive, Field(description="what the valves stand")] = 1.5


class SupplyHigh(Monitor):
    """The supply must not be above what the valves stand."""

    fault = Fault("supply_high", 31, Policy.HOLD, "a regulator that fails", "turn it down")
    looks_at = "the supply, from above"
    how_to_set = "the data sheet of the valves"
    keys = SupplyHighKeys

    def __init__(self, arm: Arm, keys: SupplyHighKeys) -> None:
        self._highest_pa = keys.highest_bar * BAR

    def look(self, seen: Observation) -> str:
        return f"the supply has {bar(seen.supply_pa)}" if seen.supply_pa > self._highest_pa else ""


#: Run in a process of its own: the list is read when the configuration is imported.
PROGRAM = """
import contextlib, io, json
from pneuarm.service.monitors import monitors
from tests.service.monitors.test_own_monitor import SupplyHigh

monitors.MONITORS += (SupplyHigh,)

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.service.cli.parser import build_parser, main
from pneuarm.service.configuration.configuration import check, load
from tools.rig.faulty import Faulty
from tools.docs.pages import make
from tools.rig.simulated import Bench

def with_highest(bar):
    return check(load().model_dump() | {"monitors": {"supply_high": {"highest_bar": bar}}})

def session(configuration):
    bench = Bench(configuration=configuration)
    bench.hardware.device = Faulty(bench.hardware.device, bench.arm)  # its supply has 2 bar
    bench.tick()
    event = next((event for event in bench.events if event.code == "supply_high"), None)
    told = None if event is None else [event.text, event.cause, event.remedy]
    return int(bench.newest["active_faults"]), told

def refusal():
    try:
        with_highest(-1.0)
    except ConfigurationError as error:
        return str(error)

shown = io.StringIO()
with contextlib.redirect_stdout(shown):
    main(["config", "show"])
print(json.dumps({
    "shown": shown.getvalue(),
    "refusal": refusal(),
    "by default": session(load()),
    "set higher": session(with_highest(3.0)),
    "keys": make("configuration monitors") + make("configuration below monitors"),
    "faults": make("faults"),
    "monitors": make("monitors"),
    "codes": make("codes"),
}))
"""


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    """What a program with the monitor in its list has of it."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    whole: dict[str, Any] = json.loads(done.stdout)
    return whole


def test_its_table_is_in_the_configuration(found: dict[str, Any]) -> None:
    assert "[monitors.supply_high]\nhighest_bar = 1.5\n" in found["shown"]
    assert "monitors.supply_high.highest_bar" in found["refusal"]
    assert "-1.0" in found["refusal"]


def test_its_fault_has_its_bit_and_its_sentence(found: dict[str, Any]) -> None:
    bits, (text, cause, remedy) = found["by default"]
    assert bits == 1 << SupplyHigh.fault.bit
    assert SupplyHigh.fault.cause in text
    assert SupplyHigh.fault.policy.consequence in text
    assert "2.000 bar" in cause
    assert remedy == SupplyHigh.fault.remedy


def test_its_key_sets_its_threshold(found: dict[str, Any]) -> None:
    assert found["set higher"] == [0, None]


def test_the_documents_have_it(found: dict[str, Any]) -> None:
    assert "[monitors.supply_high]" in found["keys"]
    assert "| `highest_bar` | bar | 1.5 | above 0 | what the valves stand |" in found["keys"]
    assert f"| `supply_high` | {1 << 31} | hold |" in found["faults"]
    assert (
        f"| `supply_high` | {SupplyHigh.looks_at} | {SupplyHigh.how_to_set} |"
        in (found["monitors"])
    )
    assert "`supply_high`" in found["codes"]
