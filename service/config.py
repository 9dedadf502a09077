"""TOML -> checked, frozen configuration.

A file is laid over one of the built-in arms (`preset`, "paper" unless it says otherwise), so it
holds only what differs. People read and write millimetres, degrees and bar here; everything
behind this module is SI. A wrong key or value is refused before any device is touched.
"""

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

import tomli_w
from platformdirs import user_state_path
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from controllers.arm import Arm, Section
from controllers.errors import ConfigurationError, InvalidInput
from controllers.settings import ControlSettings
from controllers.targets import LawName

PRESETS = ("paper", "table1", "trunk")

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]

Endpoint = Annotated[
    str, Field(pattern=r"^(tcp|tls|udp|quic|ws|unixsock-stream|unixpipe|serial|vsock)/[^\s]+$")
]

MM, BAR = 1e-3, 1e5


class _Table(BaseModel):
    """A table of the file: unknown keys are errors, values are never changed afterwards."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class SectionConfig(_Table):
    """One section of the arm."""

    rest_length_mm: Positive
    chamber_offset_mm: Positive
    length_min_mm: Positive
    length_max_mm: Positive
    bend_max_deg: Annotated[float, Field(gt=0, le=350)]
    length_rate_max_mm_s: Positive
    pressure_min_bar: Annotated[float, Field(ge=-1.0, le=0.0)]
    pressure_max_bar: Annotated[float, Field(gt=0.0, le=10.0)]
    pressure_slew_max_bar_s: Positive
    lengthening_mm_per_bar: Positive
    softening_mm_per_bar2: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0

    @model_validator(mode="after")
    def _bounds_in_order(self) -> "SectionConfig":
        if not self.length_min_mm < self.rest_length_mm < self.length_max_mm:
            raise ValueError(
                f"length_min_mm = {self.length_min_mm:g}, rest_length_mm = "
                f"{self.rest_length_mm:g} and length_max_mm = {self.length_max_mm:g} "
                "must increase in this order"
            )
        return self

    def section(self) -> Section:
        """Return the section in SI units."""
        return Section(
            rest_length_m=self.rest_length_mm * MM,
            chamber_offset_m=self.chamber_offset_mm * MM,
            length_min_m=self.length_min_mm * MM,
            length_max_m=self.length_max_mm * MM,
            bend_max_rad=self.bend_max_deg * 0.017453292519943295,
            length_rate_max_m_s=self.length_rate_max_mm_s * MM,
            pressure_min_pa=self.pressure_min_bar * BAR,
            pressure_max_pa=self.pressure_max_bar * BAR,
            pressure_slew_max_pa_s=self.pressure_slew_max_bar_s * BAR,
            lengthening_m_per_pa=self.lengthening_mm_per_bar * MM / BAR,
            softening_m_per_pa2=self.softening_mm_per_bar2 * MM / BAR**2,
        )


class ArmConfig(_Table):
    """The arm: its name on the wire, gravity in its base frame, its sections from the base on."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,31}$")]
    gravity_m_s2: Annotated[tuple[Finite, Finite, Finite], Field(strict=False)]
    sections: Annotated[tuple[SectionConfig, ...], Field(min_length=1, max_length=16, strict=False)]


class ControlConfig(_Table):
    """The loop and the laws."""

    rate_hz: Annotated[float, Field(ge=50, le=2000)] = 1000.0
    law: Literal["resolved_rate", "qp_ik"] = "qp_ik"
    gain_per_s: Annotated[float, Field(gt=0, le=200)] = 30.0
    tip_speed_max_mm_s: Positive = 400.0
    reached_tolerance_mm: Positive = 0.5
    target_timeout_ms: Annotated[float, Field(ge=20, le=5000)] = 200.0
    arming_timeout_s: Annotated[float, Field(ge=1, le=600)] = 30.0
    hold_timeout_s: Annotated[float, Field(ge=1, le=3600)] = 60.0
    lease_timeout_s: Annotated[float, Field(ge=0.5, le=600)] = 5.0
    spin_us: Annotated[float, Field(ge=0, le=1000)] = 120.0
    priority: Annotated[int, Field(ge=1, le=98)] = 80

    def settings(self) -> ControlSettings:
        """Return what the laws need, in SI units."""
        return ControlSettings(
            default_law=LawName[self.law.upper()],
            gain_per_s=self.gain_per_s,
            tip_speed_max_m_s=self.tip_speed_max_mm_s * MM,
            reached_tolerance_m=self.reached_tolerance_mm * MM,
        )


class HardwareConfig(_Table):
    """The device that moves the air. ``device`` empty means one simulator an arm."""

    adapter: Literal["simulator"] = "simulator"
    device: Annotated[str, Field(max_length=64, pattern=r"^[\x20-\x7e]*$")] = ""


class SimulatorConfig(_Table):
    """The simulated arm: every parameter is drawn from the seed."""

    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0


class ZenohConfig(_Table):
    """Where the daemon listens; a Zenoh file goes first and may bring TLS and access control."""

    listen: Annotated[tuple[Endpoint, ...], Field(min_length=1, strict=False)] = (
        "tcp/127.0.0.1:7447",
    )
    config_file: str = ""


class RerunConfig(_Table):
    """The live view."""

    enabled: bool = True
    bind: str = "127.0.0.1"
    port: Annotated[int, Field(ge=1, le=65535)] = 9876
    memory_limit_mib: Annotated[int, Field(ge=16, le=65536)] = 512
    open_viewer: bool = False


class LogConfig(_Table):
    """The session log. ``directory`` empty means the user's state directory."""

    directory: str = ""
    roll_mib: Positive = 1024.0
    roll_minutes: Positive = 60.0
    keep_gib: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    min_free_mib: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 1024.0
    full_disk_vent_s: Annotated[float, Field(ge=0, le=600)] = 5.0


class Configuration(_Table):
    """Everything the daemon is told."""

    preset: Literal["paper", "table1", "trunk"] = "paper"
    arm: ArmConfig
    control: ControlConfig = ControlConfig()
    hardware: HardwareConfig = HardwareConfig()
    simulator: SimulatorConfig = SimulatorConfig()
    zenoh: ZenohConfig = ZenohConfig()
    rerun: RerunConfig = RerunConfig()
    log: LogConfig = LogConfig()

    def build_arm(self) -> Arm:
        """Return the arm in SI units."""
        sections = tuple(section.section() for section in self.arm.sections)
        return Arm(self.arm.name, sections, self.arm.gravity_m_s2)

    @property
    def device_address(self) -> str:
        """What the lock is on: one daemon a device, whatever the arm is called."""
        return f"{self.hardware.adapter}:{self.hardware.device or self.arm.name}"

    def to_toml(self) -> str:
        """Return the effective configuration as a file that gives it again."""
        return tomli_w.dumps(self.model_dump(mode="python"))


def log_directory(configuration: Configuration) -> Path:
    """Return the directory of the sessions: the configured one, or in the user's state."""
    named = configuration.log.directory
    default = user_state_path("pneuarm") / "sessions"
    return Path(named).expanduser() if named else default


def rerun_url(configuration: Configuration) -> str:
    """Address under which a Rerun viewer finds the live view."""
    bind = configuration.rerun.bind
    host = "127.0.0.1" if bind in ("0.0.0.0", "::") else bind
    return f"rerun+http://{host}:{configuration.rerun.port}/proxy"


def load(path: Path | None = None, preset: str | None = None) -> Configuration:
    """Read a file over a built-in arm; raises ConfigurationError with one sentence a mistake."""
    where = str(path) if path else "configuration"
    own = {} if path is None else _read(path)
    name = preset or own.get("preset", "paper")
    if name not in PRESETS:
        raise ConfigurationError(f"{where}: preset = {name!r}; allowed: {', '.join(PRESETS)}")
    text = files("service").joinpath("presets", f"{name}.toml").read_text()
    return check(_laid_over(tomllib.loads(text), own | {"preset": name}), where)


def check(tables: dict[str, Any], where: str = "configuration") -> Configuration:
    """Check tables as a file has them; raises ConfigurationError."""
    try:
        configuration = Configuration.model_validate(tables)
        configuration.build_arm()
    except ValidationError as error:
        items = error.errors()
        if len(items) > 1:  # a list counts as short because its elements were refused: no news
            items = [item for item in items if item["type"] != "too_short"]
        lines = [f"{where}: {_sentence(item)}" for item in items]
        raise ConfigurationError("\n".join(lines)) from error
    except InvalidInput as error:
        raise ConfigurationError(f"{where}: arm: {error}") from error
    return configuration


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text())
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ConfigurationError(f"{path} is not TOML: {error}") from error


def _laid_over(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Merge tables key by key; anything that is no table, lists too, is replaced whole."""
    merged = dict(below)
    for key, value in above.items():
        old = merged.get(key)
        both = isinstance(old, dict) and isinstance(value, dict)
        merged[key] = _laid_over(old, value) if both and isinstance(old, dict) else value
    return merged


def _sentence(item: Any) -> str:
    """One mistake as key, value and what is allowed."""
    steps = [f"[{step}]" if isinstance(step, int) else f".{step}" for step in item["loc"]]
    key = "".join(steps).lstrip(".") or "file"
    if item["type"] == "extra_forbidden":
        return f"{key}: no such key; allowed here: {', '.join(_keys_beside(item['loc']))}"
    if item["type"] == "missing":
        return f"{key} is missing"
    message = item["msg"].removeprefix("Value error, ")
    if item["type"] == "value_error":
        return f"{key}: {message}"
    return f"{key} = {item['input']!r}: {message[0].lower()}{message[1:]}"


def _keys_beside(location: tuple[int | str, ...]) -> list[str]:
    """Return the keys that stand where an unknown one was found."""
    model: type[BaseModel] = Configuration
    for step in location[:-1]:
        if isinstance(step, int):
            model = SectionConfig
        else:
            inner = model.model_fields[step].annotation
            model = inner if isinstance(inner, type) and issubclass(inner, BaseModel) else model
    return list(model.model_fields)
