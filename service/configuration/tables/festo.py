"""Festo terminals over Modbus TCP: where they are, how they are wired, their watchdog."""

from typing import Annotated, Literal

from pydantic import Field

from pneuarm.service.configuration.tables.table import Positive, Table

Register = Annotated[int, Field(ge=0, le=65535)]
Stride = Annotated[int, Field(ge=1, le=64)]
InputStride = Annotated[int, Field(ge=3, le=64)]


class FestoConfig(Table):
    """What both kinds of terminal share. ``valves`` empty means 0, 1, 2, ... in chamber order.

    ``failsafe_register`` -1 means that the terminal does not show it.
    """

    host: Annotated[str, Field(max_length=253, pattern=r"^[\x21-\x7e]*$")] = ""
    port: Annotated[int, Field(ge=1, le=65535)] = 502
    unit_id: Annotated[int, Field(ge=0, le=255)] = 1
    timeout_ms: Annotated[float, Field(ge=2, le=150)] = 50.0
    valves: Annotated[
        tuple[Annotated[int, Field(ge=0, le=255)], ...], Field(max_length=48, strict=False)
    ] = ()
    valve_range: Literal["pressure", "vacuum"] = "pressure"
    ceiling_bar: Positive = 1.2
    output_base: Register = 40003
    input_base: Register = 45395
    input_stride: InputStride = 3
    watchdog_register: Register = 46100
    watchdog_words: Literal[1, 2] = 1
    watchdog_ms: Annotated[int, Field(ge=0, le=60000)] = 200
    failsafe_register: Annotated[int, Field(ge=-1, le=65535)] = -1


class FestoCpxConfig(FestoConfig):
    """A CPX terminal with VPPM valves, a register each."""

    output_stride: Stride = 1


class FestoVtemConfig(FestoConfig):
    """A VTEM motion terminal; a slot drives two valves and takes three registers."""

    output_stride: InputStride = 3
    start_timeout_s: Annotated[float, Field(gt=0, le=60)] = 20.0
