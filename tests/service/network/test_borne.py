"""What strangers may do to the door: connections that say nothing, messages without end, forks."""

import contextlib
import json
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import zenoh

from pneuarm.service.network.sessions import open_connected, open_listening
from tools.rig.certificates import Authority
from tools.rig.daemon import free_port, wait_for


@contextlib.contextmanager
def silent_connections(port: int, number: int) -> Iterator[None]:
    """Connect and never say a word."""
    with contextlib.ExitStack() as stack:
        for _ in range(number):
            silent = stack.enter_context(socket.socket())
            silent.setblocking(False)
            silent.connect_ex(("127.0.0.1", port))
        yield


def own_file(folder: Path, **tables: object) -> str:
    path = folder / f"zenoh-{len(list(folder.iterdir()))}.json5"
    path.write_text(json.dumps(tables))
    return str(path)


def secured(folder: Path, name: str, side: str) -> str:
    tls = {
        "root_ca_certificate": str(folder / "ca.pem"),
        f"{side}_certificate": str(folder / f"{name}.pem"),
        f"{side}_private_key": str(folder / f"{name}.key"),
        "enable_mtls": True,
    }
    return own_file(folder, transport={"link": {"tls": tls}})


@pytest.mark.parametrize("protocol", ["tcp", "tls"])
def test_connections_that_say_nothing_keep_nobody_out(tmp_path: Path, protocol: str) -> None:
    files = ["", ""]
    if protocol == "tls":
        authority = Authority(tmp_path)
        authority.sign("robot")
        authority.sign("operator")
        files = [secured(tmp_path, "robot", "listen"), secured(tmp_path, "operator", "connect")]
    port = free_port()
    endpoint = f"{protocol}/127.0.0.1:{port}"
    with open_listening([endpoint], files[0]), silent_connections(port, 400):
        open_connected(endpoint, files[1]).close()


def test_a_client_that_finds_the_door_full_tries_again(tmp_path: Path) -> None:
    port = free_port()
    endpoint = f"tcp/127.0.0.1:{port}"
    narrow = {"accept_pending": 3, "accept_timeout": 1500}
    config = own_file(tmp_path, transport={"unicast": narrow})
    with open_listening([endpoint], config), silent_connections(port, 3):
        open_connected(endpoint).close()


def test_a_zenoh_file_that_says_otherwise_is_kept(tmp_path: Path) -> None:
    port = free_port()
    endpoint = f"tcp/127.0.0.1:{port}"
    config = own_file(tmp_path, transport={"unicast": {"accept_pending": 3}})
    with open_listening([endpoint], config) as session:
        assert session.info.zid()
        with silent_connections(port, 3), socket.socket() as probe:
            time.sleep(0.2)
            probe.connect(("127.0.0.1", port))
            probe.settimeout(5.0)
            assert probe.recv(1) == b""  # turned away at once: the three are all that may wait


def test_a_message_without_end_never_arrives_and_the_next_one_does() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with open_listening([endpoint], "") as session, open_connected(endpoint) as sender:
        sizes: list[int] = []
        subscriber = session.declare_subscriber(
            "x", lambda sample: sizes.append(len(sample.payload))
        )
        block = zenoh.CongestionControl.BLOCK

        def arrived() -> bool:
            sender.put("x", b"first", congestion_control=block)
            return bool(sizes)

        wait_for(arrived, "the way to be known")
        sender.put("x", bytes(30_000_000), congestion_control=block)
        sender.put("x", b"the last one", congestion_control=block)
        wait_for(lambda: sizes[-1] == len(b"the last one"), "the message behind")
        assert max(sizes) < 1000
        subscriber.undeclare()
