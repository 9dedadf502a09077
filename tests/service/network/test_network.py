"""Endpoints: which are this machine's own, which are taken. No session is opened here."""

import socket
from pathlib import Path

import pytest

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.service.network.sessions import check_free, is_loopback, read_config


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
    assert is_loopback(endpoint) == loopback


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
        assert str(caught.value) == (
            f"zenoh.listen: {shown}:{port} cannot be used (Address already in use); is another "
            "daemon or viewer running there? choose another port"
        )
    check_free("zenoh.listen", f"tcp/{shown}:{port}")
    check_free("rerun.port", f"tcp/{host}:{port}")  # as the key `bind` has it


def test_a_port_that_was_free_is_left_free() -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    for _ in range(3):
        check_free("zenoh.listen", f"tcp/127.0.0.1:{port}")


@pytest.mark.parametrize(
    ("endpoint", "words"),
    [
        ("tcp/127.0.0.1:70000", "port 70000 of tcp/127.0.0.1:70000; allowed: 0 to 65535"),
        ("tcp/192.0.2.1:7447", "192.0.2.1:7447 cannot be used (Cannot assign requested address)"),
    ],
)
def test_an_address_that_is_none_of_ours_is_refused(endpoint: str, words: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        check_free("zenoh.listen", endpoint)
    assert str(caught.value).startswith(f"zenoh.listen: {words}")


@pytest.mark.parametrize("endpoint", ["udp/127.0.0.1:1", "unixpipe//x", "tcp/127.0.0.1", "tcp/a:²"])
def test_other_endpoints_are_zenohs_own_affair(endpoint: str) -> None:
    check_free("zenoh.listen", endpoint)


def test_a_zenoh_file_that_is_missing_or_wrong_is_refused(tmp_path: Path) -> None:
    missing = tmp_path / "zenoh.json5"
    with pytest.raises(ConfigurationError) as caught:
        read_config(str(missing))
    assert str(caught.value) == f"zenoh.config_file = {str(missing)!r}: no such file"
    missing.write_text("{ mode: 'octopus' ")
    with pytest.raises(ConfigurationError, match=r"^zenoh\.config_file = .*zenoh\.json5'"):
        read_config(str(missing))
    missing.write_text("{ mode: 'peer' }")
    assert read_config(str(missing)).get_json("mode") == '"peer"'
