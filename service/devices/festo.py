"""Configuration of a Festo terminal -> its adapter or its emulator's parts, wiring checked."""

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.festo.terminal_watchdog import TerminalWatchdog
from pneuarm.hardware.festo_cpx.adapter import CpxSettings, FestoCpx
from pneuarm.hardware.festo_cpx.protocol import CpxLayout
from pneuarm.hardware.festo_vtem.adapter import FestoVtem, VtemSettings
from pneuarm.hardware.festo_vtem.protocol import VtemLayout
from pneuarm.hardware.interface import Hardware
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.configuration.tables.festo import FestoConfig, FestoCpxConfig, FestoVtemConfig
from pneuarm.service.configuration.tables.table import BAR

_LAST_REGISTER = 65535


def cpx(configuration: Configuration, arm: Arm) -> Hardware:
    """Make the adapter of a CPX terminal; raises ConfigurationError for a wrong wiring."""
    table = configuration.festo_cpx
    _check("festo_cpx", table, arm)
    settings = CpxSettings(
        host=table.host,
        port=table.port,
        unit_id=table.unit_id,
        timeout_s=table.timeout_ms * 1e-3,
        layout=cpx_layout(table, arm),
        watchdog=watchdog(table),
    )
    return FestoCpx(arm, settings)


def vtem(configuration: Configuration, arm: Arm) -> Hardware:
    """Make the adapter of a VTEM; raises ConfigurationError for a wrong wiring."""
    table = configuration.festo_vtem
    _check("festo_vtem", table, arm)
    settings = VtemSettings(
        host=table.host,
        port=table.port,
        unit_id=table.unit_id,
        timeout_s=table.timeout_ms * 1e-3,
        start_timeout_s=table.start_timeout_s,
        layout=vtem_layout(table, arm),
        watchdog=watchdog(table),
    )
    return FestoVtem(arm, settings)


def cpx_layout(table: FestoCpxConfig, arm: Arm) -> CpxLayout:
    """Return where the valves lie."""
    return CpxLayout(
        valves=_valves(table, arm),
        output_base=table.output_base,
        output_stride=table.output_stride,
        input_base=table.input_base,
        input_stride=table.input_stride,
    )


def vtem_layout(table: FestoVtemConfig, arm: Arm) -> VtemLayout:
    """Return where the slots lie."""
    return VtemLayout(
        valves=_valves(table, arm),
        output_base=table.output_base,
        output_stride=table.output_stride,
        input_base=table.input_base,
        input_stride=table.input_stride,
    )


def watchdog(table: FestoConfig) -> TerminalWatchdog:
    """Return where the terminal keeps its watchdog."""
    failsafe = None if table.failsafe_register < 0 else table.failsafe_register
    return TerminalWatchdog(
        table.watchdog_register, table.watchdog_words, table.watchdog_ms, failsafe
    )


def _valves(table: FestoConfig, arm: Arm) -> tuple[int, ...]:
    return table.valves or tuple(range(arm.n_chambers))


def _check(name: str, table: FestoCpxConfig | FestoVtemConfig, arm: Arm) -> None:
    if not table.host:
        raise ConfigurationError(f'{name}.host is missing: the terminal\'s address, "192.168.1.1"')
    valves = _valves(table, arm)
    for valve in valves:
        if valves.count(valve) > 1:
            raise ConfigurationError(
                f"{name}.valves = {list(valves)}: valve {valve} is mapped twice; every chamber "
                "needs a valve of its own"
            )
    if len(valves) != arm.n_chambers:
        raise ConfigurationError(
            f"{name}.valves = {list(valves)}: {len(valves)} valves for {arm.n_chambers} chambers; "
            "one valve for every chamber is needed, in the order of the chambers"
        )
    _check_registers(name, table, valves)
    _check_range(name, table, arm)


def _check_registers(
    name: str, table: FestoCpxConfig | FestoVtemConfig, valves: tuple[int, ...]
) -> None:
    per_unit = 2 if isinstance(table, FestoVtemConfig) else 1
    furthest = max(valves) // per_unit
    for key, stride in (("output", table.output_stride), ("input", table.input_stride)):
        base = getattr(table, f"{key}_base")
        last = base + stride * (furthest + 1) - 1
        if last > _LAST_REGISTER:
            raise ConfigurationError(
                f"{name}.{key}_base = {base}: valve {max(valves)} would lie at register {last}; "
                f"registers end at {_LAST_REGISTER}"
            )


def _check_range(name: str, table: FestoConfig, arm: Arm) -> None:
    lowest_bar = float(arm.per_chamber("pressure_min_pa").min()) / BAR
    highest_bar = float(arm.per_chamber("pressure_max_pa").max()) / BAR
    if lowest_bar < 0.0 and table.valve_range == "pressure":
        raise ConfigurationError(
            f'{name}.valve_range = "pressure" and the arm\'s pressure_min_bar = {lowest_bar:g}: '
            'such valves misbehave below 0; set pressure_min_bar = 0, or valve_range = "vacuum" '
            "where every valve of the arm regulates vacuum too"
        )
    if highest_bar > table.ceiling_bar:
        raise ConfigurationError(
            f"{name}.ceiling_bar = {table.ceiling_bar:g} is below the arm's pressure_max_bar = "
            f"{highest_bar:g}; lower the arm's limit, or raise the ceiling where all bear it"
        )
