"""Endpoints: which are this machine's own, which are taken. No session is opened here."""

import errno
import os
import socket
from pathlib import Path

import pytest

from pneuarm.controllers.arm.errors import ConfigurationError, InvalidInput
from pneuarm.service.network.endpoint import Endpoint
from pneuarm.service.network.sessions import check_free, open_connected, read_config


@pytest.mark.parametrize(
    ("endpoint", "loopback"),
    [
        ("tcp/127.0.0.1:7447", True),
        ("tcp/127.9.9.9:1", True),
        ("tls/localhost:7447", True),
        ("tcp/[::1]:7447", True),
        ("tcp/127.0.0.1:7447#iface=lo", True),
        ("unixsock-stream//tmp/x.sock", True),
        ("tcp/0.0.0.0:7447", False),
        ("tcp/[::]:7447", False),
        ("udp/192.168.1.2:7447", False),
        ("tcp/robot.local:7447", False),
        ("tcp/127.0.0.1.example.org:7447", False),
        ("tcp/localhost.example.org:7447", False),
        ("tcp/10.0.0.1:7447#iface=127.0.0.1:1", False),
    ],
)
def test_which_endpoints_are_reached_from_this_machine_only(endpoint: str, loopback: bool) -> None:
    assert Endpoint.parse(endpoint).is_loopback == loopback


@pytest.mark.parametrize("family", [socket.AF_INET, socket.AF_INET6])
def test_a_port_that_is_taken_is_refused_before_anything_starts(
    family: socket.AddressFamily,
) -> None:
    host = "127.0.0.1" if family == socket.AF_INET else "::1"
    shown = host if family == socket.AF_INET else f"[{host}]"
    with socket.socket(family) as other:
        other.bind((host, 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(ConfigurationError) as caught:
            check_free("zenoh.listen", f"tcp/{shown}:{port}")
        for fact in ("zenoh.listen", f"{shown}:{port}", os.strerror(errno.EADDRINUSE)):
            assert fact in str(caught.value)
    check_free("zenoh.listen", f"tcp/{shown}:{port}")


def test_a_port_that_was_free_is_left_free() -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    for _ in range(3):
        check_free("zenoh.listen", f"tcp/127.0.0.1:{port}")


@pytest.mark.parametrize(
    ("endpoint", "facts"),
    [
        ("tcp/127.0.0.1:70000", ("70000", "65535")),
        ("tcp/192.0.2.1:7447", ("192.0.2.1:7447", os.strerror(errno.EADDRNOTAVAIL))),
        ("tcp/nobody.invalid:7447", ("nobody.invalid:7447",)),
    ],
)
def test_an_address_that_is_none_of_ours_is_refused(endpoint: str, facts: tuple[str, ...]) -> None:
    with pytest.raises(ConfigurationError) as caught:
        check_free("zenoh.listen", endpoint)
    assert all(fact in str(caught.value) for fact in ("zenoh.listen", *facts))


@pytest.mark.parametrize("endpoint", ["udp/127.0.0.1:1", "unixpipe//x"])
def test_other_endpoints_are_zenohs_own_affair(endpoint: str) -> None:
    check_free("zenoh.listen", endpoint)


#: What a person types for an address, and what the refusal must tell.
NO_ADDRESS = {
    "": "tcp/127.0.0.1:7447",
    "127.0.0.1:7599": "'127.0.0.1:7599'",
    "localhost": "'localhost'",
    "tcp": "'tcp'",
    "tcp/": "'tcp/'",
    "tcp/:1": "'tcp/:1'",
    "tcp/127.0.0.1": "port",
    "tcp/127.0.0.1:": "port",
    "tcp/127.0.0.1:99999": "65535",
    "tcp/127.0.0.1:-1": "65535",
    "tcp/127.0.0.1:" + "9" * 6000: "tcp/127.0.0.1:999",
    "tcp/a:²": "port",
    "tcp/::1:7447": "[::1]",
    "tcp/[::1:7447": "[::1]",
    "tcp/[zz::]:7447": "[::1]",
    "http/127.0.0.1:1": "tls",
    "tcp/a b:1": "'tcp/a b:1'",
    "tcp/a\0b:1": r"'tcp/a\x00b:1'",
    "tcp/a\n:1": r"'tcp/a\n:1'",
    "tcp/" + "a" * 6000 + ":1": "tcp/aaa",
    "tcp/\udcff:1": r"\udcff",
    "/127.0.0.1:1": "tcp",
}


@pytest.mark.parametrize("text", NO_ADDRESS, ids=lambda text: ascii(text)[:30])
def test_what_is_no_address_is_refused_with_it_and_what_one_is(text: str) -> None:
    for read in (Endpoint.parse, open_connected):
        with pytest.raises(InvalidInput) as refused:
            read(text)
        told = str(refused.value)
        assert NO_ADDRESS[text] in told
        assert len(told) < 400
        assert told.isprintable()


def test_a_zenoh_file_that_is_missing_or_wrong_is_refused(tmp_path: Path) -> None:
    missing = tmp_path / "zenoh.json5"
    with pytest.raises(ConfigurationError) as caught:
        read_config(str(missing))
    assert "zenoh.config_file" in str(caught.value)
    assert repr(str(missing)) in str(caught.value)
    missing.write_text("{ mode: 'octopus' ")
    with pytest.raises(ConfigurationError, match=r"^zenoh\.config_file = .*zenoh\.json5'"):
        read_config(str(missing))
    for other in (str(tmp_path), "/dev/null", "a\0b", "x" * 5000):
        with pytest.raises(ConfigurationError, match=r"^zenoh\.config_file = "):
            read_config(other)
    missing.write_text("{ mode: 'peer' }")
    assert read_config(str(missing)).get_json("mode") == '"peer"'
