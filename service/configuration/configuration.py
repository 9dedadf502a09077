"""TOML -> checked, frozen configuration.

A file is laid over one of the built-in arms (`preset`, "paper" unless it says otherwise), so it
holds only what differs. People read and write millimetres, degrees and bar here; everything
behind this module is SI. A wrong key or value is refused before any device is touched. The tables
themselves are in :mod:`pneuarm.service.configuration.tables`.
"""

import tomllib
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, get_args

import tomli_w
from platformdirs import user_state_path
from pydantic import BaseModel, Field, ValidationError, create_model, model_validator

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError, InvalidInput
from pneuarm.controllers.limits.limits import refuse_contradictions
from pneuarm.hardware.device import Device
from pneuarm.hardware.simulator.device import DEVICE as SIMULATOR
from pneuarm.hardware.simulator.device import SimulatedDevice, SimulatorConfig, simulated_arm
from pneuarm.hardware.tables.arm import ArmConfig, with_two_lags
from pneuarm.hardware.tables.table import Table
from pneuarm.logs.schema.printable import printable
from pneuarm.service.configuration.devices import AnyDevice, devices
from pneuarm.service.configuration.tables.control import ControlConfig
from pneuarm.service.configuration.tables.feedback import FeedbackConfig, ReferenceConfig
from pneuarm.service.configuration.tables.frames import FramesConfig
from pneuarm.service.configuration.tables.hardware import HardwareConfig
from pneuarm.service.configuration.tables.monitors import MOVED, MonitorsConfig, moved
from pneuarm.service.configuration.tables.outputs import LogConfig, RerunConfig, ZenohConfig
from pneuarm.service.configuration.text_file import read_text
from pneuarm.service.network.endpoint import Endpoint, in_url

#: Characters of a refusal, and of a value in it.
_LONGEST, _LONGEST_VALUE = 2000, 200

PRESETS = ("paper", "table1", "trunk")

DeviceConfig = TypeVar("DeviceConfig", bound=Table)


class _Configuration(Table):
    """Everything the daemon is told, but for the tables of the devices."""

    preset: Annotated[
        Literal["paper", "table1", "trunk"], Field(description="built-in arm below this file")
    ] = "paper"
    arm: ArmConfig
    control: ControlConfig = ControlConfig()
    reference: ReferenceConfig = ReferenceConfig()
    feedback: FeedbackConfig = FeedbackConfig()
    frames: FramesConfig = FramesConfig()
    hardware: HardwareConfig = HardwareConfig()
    monitors: MonitorsConfig = MonitorsConfig()
    simulator: SimulatorConfig = SimulatorConfig()
    zenoh: ZenohConfig = ZenohConfig()
    rerun: RerunConfig = RerunConfig()
    log: LogConfig = LogConfig()

    @model_validator(mode="after")
    def _simulated_as_controlled(self) -> "_Configuration":
        there, here = len((self.simulated.arm or self.arm).sections), len(self.arm.sections)
        if there != here:
            table = (self.device if self.is_simulated else SIMULATOR).table
            raise ValueError(
                f"{table}.arm has {there} sections, arm has {here}; the numbers must be equal"
            )
        return self

    @model_validator(mode="after")
    def _one_listener_a_port(self) -> "_Configuration":
        taken: dict[int, str] = {}
        wanted = [(text, Endpoint.parse(text)) for text in self.zenoh.listen]
        ports = [(f"zenoh.listen {text}", point.port) for text, point in wanted if point.is_tcp]
        if self.rerun.enabled and self.rerun.start_server:
            ports.append(("rerun.port", self.rerun.port))
        for name, port in ports:
            if port and port in taken:
                raise ValueError(f"{name} and {taken[port]} have the same port {port}")
            taken[port or 0] = name
        return self

    def build_arm(self) -> Arm:
        """Return the arm that the controller believes in, in SI units."""
        return replace(self.arm.build(), tool_m=self.frames.tool_m())

    def build_simulated_arm(self) -> Arm:
        """Return the arm that is calculated here: ``arm``, or the one of the table `simulated`."""
        return simulated_arm(self.simulated, self.arm.build())

    @property
    def device(self) -> AnyDevice:
        """The kind of device that moves the air."""
        return devices().named(self.hardware.adapter)

    @property
    def is_simulated(self) -> bool:
        """Whether the arm itself is calculated here, so that its true tip is known."""
        return isinstance(self.device, SimulatedDevice)

    @property
    def simulated(self) -> SimulatorConfig:
        """The table of the arm that is calculated here, as the device or behind an emulated one."""
        return self.of_device(self.device) if self.is_simulated else self.simulator

    def of_device(self, device: Device[DeviceConfig]) -> DeviceConfig:
        """Return the table of a kind of device, whether it is used or not."""
        table: DeviceConfig = getattr(self, device.table)
        return table

    def to_toml(self) -> str:
        """Return the effective configuration as a file that gives it again.

        Of the devices' tables it holds that of the device in use, and those that say something.
        """
        idle = {
            device.table
            for device in devices().usable.values()
            if device is not self.device and self.of_device(device) == device.config()
        }
        return tomli_w.dumps(self.model_dump(mode="python", exclude_none=True, exclude=idle))


# The simulated arm stands behind every emulator, so its table is one of ours.
devices().set_aside({*_Configuration.model_fields, *dir(_Configuration)} - {SIMULATOR.table})

if TYPE_CHECKING:
    Configuration = _Configuration
else:
    #: Everything the daemon is told: a table for every kind of device too.
    Configuration = create_model(
        "Configuration",
        __base__=_Configuration,
        __doc__="Everything the daemon is told.",
        __module__=__name__,
        **{
            device.table: (device.config, Field(device.config(), description=device.summary))
            for device in devices().usable.values()
            if device is not SIMULATOR
        },
    )


def log_directory(configuration: Configuration) -> Path:
    """Return the directory of the sessions: the configured one, or in the user's state.

    Raises ConfigurationError where there is neither.
    """
    if configuration.log.directory:
        return Path(configuration.log.directory).expanduser()
    default = user_state_path("pneuarm") / "sessions"
    if not default.is_absolute():
        raise ConfigurationError(
            "log.directory is missing, and this user has no home folder to take instead: name a "
            "folder for the sessions"
        )
    return default


def rerun_url(configuration: Configuration) -> str:
    """Address under which a Rerun viewer finds the live view."""
    bind = configuration.rerun.bind
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(bind, bind)
    return f"rerun+http://{in_url(host)}:{configuration.rerun.port}/proxy"


def load(path: Path | None = None, preset: str | None = None) -> Configuration:
    """Read a file over a built-in arm; raises ConfigurationError with one sentence a mistake."""
    where = str(path) if path else "configuration"
    own = {} if path is None else _read(path, where)
    name = preset or own.get("preset", "paper")
    if name not in PRESETS:
        raise ConfigurationError(
            printable(f"{where}: preset = {_value(name)}; allowed: {', '.join(PRESETS)}")
        )
    text = files("pneuarm.service.configuration").joinpath("presets", f"{name}.toml").read_text()
    return check(_laid_over(tomllib.loads(text), own | {"preset": name}), where)


def check(tables: dict[str, Any], where: str = "configuration") -> Configuration:
    """Check tables as a file has them; raises ConfigurationError."""
    try:
        configuration = Configuration.model_validate(tables)
        refuse_contradictions(configuration.build_arm())
    except ValidationError as error:
        items = error.errors()
        if len(items) > 1:  # a list counts as short because its elements were refused: no news
            items = [item for item in items if item["type"] != "too_short"]
        lines = [printable(f"{where}: {_sentence(item)}", _LONGEST) for item in items]
        raise ConfigurationError("\n".join(lines)) from error
    except InvalidInput as error:
        raise ConfigurationError(f"{where}: arm: {error}") from error
    return configuration


def recorded(toml: str, where: str) -> Configuration:
    """Check the configuration of a session, maybe of before a key moved; ConfigurationError."""
    tables = _tables(toml, where)
    if isinstance(tables.get("monitors"), dict):
        tables["monitors"] = moved(tables["monitors"])
    for table in (tables, *tables.values()):  # the arm, and one that a device simulates
        if isinstance(table, dict) and isinstance(table.get("arm"), dict):
            table["arm"] = with_two_lags(table["arm"])
    return check(tables, where)


def _read(path: Path, where: str) -> dict[str, Any]:
    try:
        text = read_text(path)
    except InvalidInput as error:
        raise ConfigurationError(str(error)) from error
    return _tables(text, where)


def _tables(text: str, where: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a number of 6000 digits is a ValueError
        raise ConfigurationError(f"{where} is not TOML: {error}") from error


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
        for broken in devices().broken.values():
            if item["loc"] == (broken.name.replace("-", "_"),):
                return f"{key}: {broken}"
        table, _, name = key.partition(".")
        if table == "monitors" and name in MOVED:
            return f"{key}: no such key; it has moved to monitors.{MOVED[name]}"
        return f"{key}: no such key; allowed here: {', '.join(_keys_beside(item['loc']))}"
    if item["type"] == "missing":
        return f"{key} is missing"
    message = item["msg"].removeprefix("Value error, ")
    if item["type"] == "value_error":
        return f"{key}: {message}"
    return f"{key} = {_value(item['input'])}: {message[0].lower()}{message[1:]}"


def _value(value: object) -> str:
    """Return a value as Python writes it, as far as anybody reads it."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # thousands of digits, or of tables in each other
        return "a value without end"
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}..."


def _keys_beside(location: tuple[int | str, ...]) -> list[str]:
    """Return the keys that stand where an unknown one was found."""
    model: type[BaseModel] = Configuration
    for step in location[:-1]:
        if isinstance(step, str) and step in model.model_fields:
            model = next(_models_in(model.model_fields[step].annotation), model)
    return list(model.model_fields)


def _models_in(annotation: object) -> Iterator[type[BaseModel]]:
    """Find the tables that an annotation names: itself, or those in a list of them."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _models_in(argument)
