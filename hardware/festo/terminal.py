"""What the two Festo terminals have in common as kinds of device: keys, wiring, emulation."""

import math
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.channels import valves_or_all
from pneuarm.hardware.device import (
    KEEPS_ITS_PRESSURES,
    Address,
    EmulatedDevice,
    Emulation,
    TcpPort,
)
from pneuarm.hardware.tables.table import BAR, Positive, Table

if TYPE_CHECKING:
    from pneuarm.hardware.emulation.emulation import EmulatedArm
    from pneuarm.hardware.festo.terminal_watchdog import TerminalWatchdog
    from pneuarm.hardware.transports.modbus_server import EmulatedTerminal

_LAST_REGISTER = 65535

Register = Annotated[int, Field(ge=0, le=_LAST_REGISTER)]
Stride = Annotated[int, Field(ge=1, le=64)]
#: Three registers a valve or slot.
WideStride = Annotated[int, Field(ge=3, le=64)]


class FestoConfig(Table):
    """What both kinds of terminal share."""

    host: Annotated[
        str,
        Field(
            max_length=253,
            pattern=r"^[\x21-\x7e]*$",
            description="name or address of the terminal; must be given",
        ),
    ] = ""
    port: Annotated[int, Field(ge=1, le=65535, description="its port")] = 502
    unit_id: Annotated[int, Field(ge=0, le=255, description="Modbus unit")] = 1
    timeout_ms: Annotated[
        float, Field(ge=2, le=150, description="an answer that takes longer is a lost device")
    ] = 50.0
    valves: Annotated[
        tuple[Annotated[int, Field(ge=0, le=255)], ...],
        Field(
            max_length=48,
            strict=False,
            description="the valve of each chamber, in the order of the chambers, none twice; "
            "empty: 0, 1, 2, ...",
        ),
    ] = ()
    valve_range: Annotated[
        Literal["pressure", "vacuum"],
        Field(
            description='"vacuum" where every valve of the arm regulates vacuum too; else an arm '
            "whose `pressure_min_bar` is below 0 is refused"
        ),
    ] = "pressure"
    ceiling_bar: Annotated[
        Positive, Field(description="an arm whose `pressure_max_bar` is above this is refused")
    ] = 1.2
    output_base: Annotated[Register, Field(description="first output register")] = 40003
    output_stride: Annotated[
        Stride, Field(description="output registers from one valve or slot to the next")
    ] = 1
    input_base: Annotated[Register, Field(description="first input register")] = 45395
    input_stride: Annotated[
        WideStride, Field(description="input registers from one valve or slot to the next")
    ] = 3
    watchdog_register: Annotated[
        Register,
        Field(description="where the terminal keeps the time of its own watchdog; 14000 on CPX-AP"),
    ] = 46100
    watchdog_words: Annotated[
        Literal[1, 2], Field(description="its size; 2 on CPX-AP, the low word first")
    ] = 1
    watchdog_ms: Annotated[
        int,
        Field(
            ge=0,
            le=60000,
            description="set at every connection and read back; 0 leaves it alone, which needs "
            "`hardware.accept_no_watchdog`",
        ),
    ] = 200
    failsafe_register: Annotated[
        int,
        Field(
            ge=-1,
            le=_LAST_REGISTER,
            description="register that shows the terminal's fail-safe setting, which must be 0 "
            "(reset all outputs); -1: not shown, so see to it yourself",
        ),
    ] = -1

    @property
    def watchdog(self) -> "TerminalWatchdog":
        """Where the terminal keeps its watchdog."""
        from pneuarm.hardware.festo.terminal_watchdog import TerminalWatchdog

        failsafe = None if self.failsafe_register < 0 else self.failsafe_register
        return TerminalWatchdog(
            self.watchdog_register, self.watchdog_words, self.watchdog_ms, failsafe
        )

    def wired_valves(self, arm: Arm) -> tuple[int, ...]:
        """Return the valve of every chamber."""
        return valves_or_all(self.valves, arm.n_chambers)


Config = TypeVar("Config", bound=FestoConfig)


class FestoTerminal(EmulatedDevice[Config]):
    """A Festo terminal over Modbus TCP."""

    #: How many valves the registers of one stride belong to.
    valves_per_stride = 1

    def address(self, config: Config) -> Address:
        """Return its port on the network."""
        return TcpPort(config.host, config.port)

    def left_behind(self, config: Config) -> str:
        """Nothing, as long as its watchdog is set."""
        return "" if config.watchdog_ms > 0 else KEEPS_ITS_PRESSURES

    def watchdog_s(self, config: Config) -> float:
        """Return the time that is set at every connection."""
        return config.watchdog_ms * 1e-3 or math.inf

    def check_wiring(self, config: Config, arm: Arm) -> None:
        """Raise ConfigurationError where the terminal is not named, or does not fit the arm."""
        name = self.table
        if not config.host:
            raise ConfigurationError(
                f'{name}.host is missing: the terminal\'s address, "192.168.1.1"'
            )
        valves = config.wired_valves(arm)
        for valve in valves:
            if valves.count(valve) > 1:
                raise ConfigurationError(
                    f"{name}.valves = {list(valves)}: valve {valve} is mapped twice; every "
                    "chamber needs a valve of its own"
                )
        if len(valves) != arm.n_chambers:
            raise ConfigurationError(
                f"{name}.valves = {list(valves)}: {len(valves)} valves for {arm.n_chambers} "
                "chambers; one valve for every chamber is needed, in the order of the chambers"
            )
        self._check_registers(config, max(valves))
        self._check_range(config, arm)

    def _check_registers(self, config: Config, last_valve: int) -> None:
        furthest = last_valve // self.valves_per_stride
        for key, base, stride in (
            ("output_base", config.output_base, config.output_stride),
            ("input_base", config.input_base, config.input_stride),
        ):
            last = base + stride * (furthest + 1) - 1
            if last > _LAST_REGISTER:
                raise ConfigurationError(
                    f"{self.table}.{key} = {base}: valve {last_valve} would lie at register "
                    f"{last}; registers end at {_LAST_REGISTER}"
                )

    def _check_range(self, config: Config, arm: Arm) -> None:
        lowest_bar = float(arm.per_chamber("pressure_min_pa").min()) / BAR
        highest_bar = float(arm.per_chamber("pressure_max_pa").max()) / BAR
        if lowest_bar < 0.0 and config.valve_range == "pressure":
            raise ConfigurationError(
                f'{self.table}.valve_range = "pressure" and the arm\'s pressure_min_bar = '
                f"{lowest_bar:g}: such valves misbehave below 0; set pressure_min_bar = 0, or "
                'valve_range = "vacuum" where every valve of the arm regulates vacuum too'
            )
        if highest_bar > config.ceiling_bar:
            raise ConfigurationError(
                f"{self.table}.ceiling_bar = {config.ceiling_bar:g} is below the arm's "
                f"pressure_max_bar = {highest_bar:g}; lower the arm's limit, or raise the ceiling "
                "where all bear it"
            )

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add where it listens, and how its watchdog is set at power-on."""
        parser.add_argument("--port", type=int, default=0, help="TCP port (default: a free one)")
        parser.add_argument("--watchdog-ms", type=int, help="its own watchdog at power-on")
        parser.add_argument("--fail-safe", choices=("reset", "hold"), default="reset")

    @contextmanager
    def _serve(
        self,
        config: Config,
        arm: Arm,
        terminal: "EmulatedTerminal",
        emulated: "EmulatedArm",
        port: int,
    ) -> Iterator[Emulation]:
        """Let a terminal listen on loopback while the context lasts."""
        from pneuarm.hardware.emulation.faults import PHYSICAL_WORDS
        from pneuarm.hardware.transports.modbus_server import LOOPBACK, ServedTerminal
        from pneuarm.hardware.transports.transport_faults import TRANSPORT_WORDS

        table: dict[str, object] = {}
        if (arm.per_chamber("pressure_min_pa") < 0.0).any():
            table["valve_range"] = "vacuum"
        largest_bar = float(arm.per_chamber("pressure_max_pa").max()) / BAR
        if largest_bar > config.ceiling_bar:
            table["ceiling_bar"] = largest_bar
        served = ServedTerminal(terminal, port)
        with served:
            where = {"host": LOOPBACK, "port": served.port}

            def inject(words: str) -> None:
                if not served.inject(words):
                    emulated.inject(words)

            yield Emulation(where | table, inject, TRANSPORT_WORDS + PHYSICAL_WORDS)


def watchdog_at_power_on(config: FestoConfig, options: Namespace) -> "TerminalWatchdog":
    """Return the watchdog of an emulated terminal before a host has set it.

    Raises ConfigurationError for a time that its registers cannot hold.
    """
    if options.watchdog_ms is None:
        return config.watchdog
    longest_ms = 2 ** (16 * config.watchdog_words) - 1
    if not 0 <= options.watchdog_ms <= longest_ms:
        raise ConfigurationError(
            f"--watchdog-ms {options.watchdog_ms}: its registers hold 0 (none) to {longest_ms} ms"
        )
    return replace(config.watchdog, timeout_ms=options.watchdog_ms)
