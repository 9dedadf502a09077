"""Where the daemon listens, what it shows and what it writes down."""

from typing import Annotated

from pydantic import Field

from pneuarm.hardware.tables.table import Positive, Table

Endpoint = Annotated[
    str, Field(pattern=r"^(tcp|tls|udp|quic|ws|unixsock-stream|unixpipe|serial|vsock)/[^\s]+$")
]


class ZenohConfig(Table):
    """Where the daemon listens; a Zenoh file goes first and may bring TLS and access control."""

    listen: Annotated[tuple[Endpoint, ...], Field(min_length=1, strict=False)] = (
        "tcp/127.0.0.1:7447",
    )
    config_file: str = ""


class RerunConfig(Table):
    """The live view."""

    enabled: bool = True
    bind: str = "127.0.0.1"
    port: Annotated[int, Field(ge=1, le=65535)] = 9876
    start_server: bool = True
    recording: Annotated[str, Field(max_length=64, pattern=r"^[\x20-\x7e]*$")] = ""
    memory_limit_mib: Annotated[int, Field(ge=16, le=65536)] = 512
    open_viewer: bool = False


class LogConfig(Table):
    """The session log. ``directory`` empty means the user's state directory."""

    directory: str = ""
    roll_mib: Positive = 1024.0
    roll_minutes: Positive = 60.0
    keep_gib: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    min_free_mib: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 1024.0
    full_disk_vent_s: Annotated[float, Field(ge=0, le=600)] = 5.0
