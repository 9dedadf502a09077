"""Where the daemon listens, what it shows and what it writes down."""

from ipaddress import ip_address
from typing import Annotated

from pydantic import AfterValidator, Field

from pneuarm.hardware.tables.table import NotNegative, PathText, Positive, Table
from pneuarm.service.network.endpoint import Endpoint


def _endpoint(text: str) -> str:
    Endpoint.parse(text)
    return text


def _ip_address(text: str) -> str:
    try:
        ip_address(text)
    except ValueError as error:
        raise ValueError(
            f"{text!r} is no IP address of this machine, such as 127.0.0.1, ::1 or 0.0.0.0"
        ) from error
    return text


class ZenohConfig(Table):
    """Where the daemon listens; a Zenoh file goes first and may bring TLS and access control."""

    listen: Annotated[
        tuple[Annotated[str, AfterValidator(_endpoint)], ...],
        Field(
            min_length=1,
            strict=False,
            description=(
                "where the daemon listens; anything but loopback is said with a warning at the "
                "start"
            ),
        ),
    ] = ("tcp/127.0.0.1:7447",)
    config_file: Annotated[
        PathText,
        Field(
            description=(
                "Zenoh's own configuration file (JSON5), for TLS and access control; empty: none. "
                "Mode, endpoints and scouting are set by the daemon after it. See docs/wire.md"
            )
        ),
    ] = ""


class RerunConfig(Table):
    """The live view."""

    enabled: Annotated[bool, Field(description="start the viewer process and Rerun's server")] = (
        True
    )
    bind: Annotated[
        str,
        AfterValidator(_ip_address),
        Field(
            description=(
                "where Rerun's server listens; anything but loopback is said with a warning at the "
                "start"
            )
        ),
    ] = "127.0.0.1"
    port: Annotated[int, Field(ge=1, le=65535, description="its port")] = 9876
    start_server: Annotated[
        bool,
        Field(
            description=(
                "false: show in a server that runs already at `bind` and `port`, and leave it "
                "running"
            )
        ),
    ] = True
    recording: Annotated[
        str,
        Field(
            max_length=64,
            pattern=r"^[\x20-\x7e]*$",
            description=(
                "Rerun recording to show in, so that several runs share one timeline; empty: one of"
                " its own for every start"
            ),
        ),
    ] = ""
    memory_limit_mib: Annotated[
        int,
        Field(ge=16, le=65536, description="how much the server keeps for viewers that come later"),
    ] = 512
    open_viewer: Annotated[
        bool,
        Field(
            description="open Rerun's window where there is a display (`--viewer` does the same)"
        ),
    ] = False


class LogConfig(Table):
    """The session log. ``directory`` empty means the user's state directory."""

    directory: Annotated[
        PathText,
        Field(
            description=(
                "where sessions go; empty: `pneuarm/sessions` in the user's state directory; `~` is"
                " understood"
            )
        ),
    ] = ""
    roll_mib: Annotated[
        Positive,
        Field(
            ge=0.01,
            description="a part that has grown to this size is followed by the next, without a gap",
        ),
    ] = 1024.0
    roll_minutes: Annotated[Positive, Field(ge=0.01, description="and so is one of this age")] = (
        60.0
    )
    keep_gib: Annotated[
        NotNegative,
        Field(
            description=(
                "delete the oldest finished parts beyond this total, whenever a part is opened; 0 "
                "keeps everything"
            ),
        ),
    ] = 0.0
    min_free_mib: Annotated[
        NotNegative,
        Field(description="with less free space, `enable` is refused"),
    ] = 1024.0
    full_disk_vent_s: Annotated[
        float,
        Field(
            ge=0,
            le=600,
            description=(
                "when the disk takes nothing more the arm holds at once, and vents after this long"
            ),
        ),
    ] = 5.0
