"""The client's own name: whatever the program, and whatever the machine are called."""

import socket

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.service.client.client import new_client_id
from pneuarm.service.wire.lease import check_name


@given(st.text(st.characters(), max_size=300), st.text(st.characters(), max_size=300))
def test_any_program_on_any_machine_has_a_name_that_the_daemon_takes(
    name: str, machine: str
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(socket, "gethostname", lambda: machine)
        check_name(new_client_id(name))


def test_a_name_says_who_it_is_and_is_new_every_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "robot-pc-" + 48 * "x")
    one, other = new_client_id("sweep"), new_client_id("sweep")
    assert one.startswith("sweep@robot-pc-")
    assert one != other
    assert len(one) <= 64
