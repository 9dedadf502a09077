"""docs/safety.md against the table of faults."""

import pytest

from pneuarm.service.safety.faults import FAULTS, FaultCode, Policy
from tests.test_docs import DOCS, rows, section


@pytest.mark.parametrize("code", FaultCode, ids=lambda code: code.name)
def test_the_table_of_faults_is_the_one_of_the_code(code: FaultCode) -> None:
    fault = FAULTS[code]
    _, bit, *cells = rows(section("safety.md", "Faults"))[code.name.lower()]
    assert bit == str(1 << code)
    assert cells == [fault.policy.name.lower(), fault.cause, fault.consequence, fault.remedy]


def test_no_other_fault_is_described() -> None:
    assert set(rows(section("safety.md", "Faults"))) == {code.name.lower() for code in FaultCode}


def test_every_policy_and_every_monitor_is_described() -> None:
    policies = section("safety.md", "What a fault does")
    for policy in Policy:
        assert f"| {policy.name.lower()} |" in policies
    monitored = rows(section("safety.md", "Monitors"))
    assert {code.name.lower() for code in FaultCode} <= set(monitored)


@pytest.mark.parametrize("code", FaultCode, ids=lambda code: code.name)
def test_every_code_of_a_fault_is_among_those_of_the_events(code: FaultCode) -> None:
    assert f"`{code.name.lower()}`" in section("wire.md", "`Event`")


def test_there_is_a_place_for_the_campaign() -> None:
    text = (DOCS / "safety.md").read_text()
    assert text.count("<!-- campaign -->") == text.count("<!-- /campaign -->") == 1
    assert text.index("<!-- campaign -->") < text.index("<!-- /campaign -->")
