"""`[monitors]`: a table for each monitor that has keys, and the ramp of a fault."""

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, create_model

from pneuarm.hardware.tables.table import Positive, Table
from pneuarm.service.monitors.monitors import MONITORS


class _Monitors(Table):
    """What of `[monitors]` is no monitor's."""

    ramp_bar_s: Annotated[
        Positive,
        Field(
            description=(
                "how fast pressures go to zero after a fault that ramps; never faster than "
                "`pressure_slew_max_bar_s`"
            )
        ),
    ] = 1.0

    def keys_of_monitors(self) -> dict[str, Table]:
        """Return the table of every monitor that has keys, by the code of its fault."""
        return {key: table for key, table in self if isinstance(table, Table)}


if TYPE_CHECKING:
    MonitorsConfig = _Monitors
else:
    #: The table with a table for every monitor that has keys.
    MonitorsConfig = create_model(
        "MonitorsConfig",
        __base__=_Monitors,
        __doc__="When something counts as a fault: how much of it, and for how long.",
        __module__=__name__,
        **{
            kind.fault.code: (kind.keys, Field(kind.keys(), description=kind.looks_at))
            for kind in MONITORS
            if kind.keys.model_fields
        },
    )

#: Where the keys stand now that stood in `[monitors]` itself before each monitor had its table.
MOVED = {
    "deviation_bar": "pressure_deviates.deviation_bar",
    "deviation_ms": "pressure_deviates.lasting_ms",
    "vent_timeout_s": "pressure_deviates.vent_timeout_s",
    "leak_bar": "leak.lost_bar",
    "leak_ms": "leak.lasting_ms",
    "supply_margin_bar": "supply_low.margin_bar",
    "supply_ms": "supply_low.lasting_ms",
    "length_tolerance_mm": "model_contradicted.length_tolerance_mm",
    "tip_tolerance_percent": "model_contradicted.tip_tolerance_percent",
    "model_ms": "model_contradicted.lasting_ms",
    "frozen_bar": "sensor_frozen.moved_bar",
    "frozen_ms": "sensor_frozen.lasting_ms",
    "sensor_margin_bar": "sensor_invalid.margin_bar",
    "sensor_ms": "sensor_invalid.lasting_ms",
    "overpressure_bar": "overpressure.margin_bar",
    "overpressure_ms": "overpressure.lasting_ms",
    "measurement_age_ms": "measurement_old.oldest_ms",
    "device_lost_ms": "device_lost.oldest_ms",
    "overrun_percent": "loop_overruns.missed_percent",
    "estimate_margin_mm": "estimate_diverges.margin_mm",
    "estimate_ms": "estimate_diverges.lasting_ms",
    "setpoint_bar": "setpoint_foreign.deviation_bar",
    "setpoint_ms": "setpoint_foreign.lasting_ms",
}


def moved(monitors: dict[str, Any]) -> dict[str, Any]:
    """Return a table `[monitors]` with every key where it stands now."""
    tables: dict[str, Any] = {key: value for key, value in monitors.items() if key not in MOVED}
    for key in MOVED.keys() & monitors.keys():
        table, _, name = MOVED[key].partition(".")
        tables[table] = {name: monitors[key]} | tables.get(table, {})
    return tables
