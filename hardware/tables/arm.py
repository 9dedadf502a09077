"""The arm: its sections and their limits."""

import math
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from pneuarm.controllers.arm.arm import (
    UNCOUPLED,
    Arm,
    HalfSpace,
    KeepOut,
    Response,
    Section,
    Sphere,
)
from pneuarm.controllers.arm.names import ARM_NAME
from pneuarm.hardware.tables.table import (
    BAR,
    DEG,
    MM,
    Finite,
    NotNegative,
    Positive,
    Table,
)

Row = Annotated[tuple[Finite, Finite, Finite], Field(strict=False)]


class SectionConfig(Table):
    """One section of the arm."""

    rest_length_mm: Annotated[Positive, Field(description="length of the vented chambers, `l0`")]
    chamber_offset_mm: Annotated[
        Positive, Field(description="distance from backbone to each chamber, `d`")
    ]
    length_min_mm: Annotated[
        Positive,
        Field(
            description=(
                "shortest chamber, not itself allowed, below `rest_length_mm`; Eq. (4) says `l0/2`"
            )
        ),
    ]
    length_max_mm: Annotated[
        Positive,
        Field(
            description=(
                "longest chamber, not itself allowed, above `rest_length_mm`; Eq. (4) says `3 l0/2`"
            )
        ),
    ]
    bend_max_deg: Annotated[float, Field(gt=0, le=350, description="largest bend of the section")]
    length_rate_max_mm_s: Annotated[
        Positive, Field(description="how fast a chamber may be commanded to change")
    ]
    length_acceleration_max_mm_s2: Annotated[
        Positive,
        Field(
            description=(
                "how fast that rate may change: 4000 takes 50 ms from rest to 200 mm/s, and the tip"
                " of `paper` then gains 2 to 8 m/s^2"
            )
        ),
    ]
    pressure_min_bar: Annotated[
        float, Field(ge=-1.0, le=0.0, description="lowest pressure; 0 where there is no vacuum")
    ]
    pressure_max_bar: Annotated[float, Field(gt=0.0, le=10.0, description="highest pressure")]
    pressure_slew_max_bar_s: Annotated[
        Positive,
        Field(description="how fast the guard lets a pressure rise or fall; venting is exempt"),
    ]
    lengthening_mm_per_bar: Annotated[
        Positive, Field(description="calibration: lengthening of a chamber near zero pressure")
    ]
    softening_mm_per_bar2: Annotated[
        NotNegative, Field(description="calibration: what is added per bar as it fills")
    ] = 0.0
    coupling: Annotated[
        tuple[Row, Row, Row],
        Field(
            strict=False,
            description=(
                "calibration: row i, column j says how much of chamber j's lengthening chamber i "
                "takes part in; invertible"
            ),
        ),
    ] = UNCOUPLED
    hysteresis_bar: Annotated[
        NotNegative, Field(description="calibration: half the width of a chamber's hysteresis loop")
    ] = 0.0
    bending_compliance_deg_per_n_m: Annotated[
        NotNegative, Field(description="calibration: how much a moment bends the section")
    ] = 0.0
    axial_compliance_mm_per_n: Annotated[
        NotNegative, Field(description="calibration: how much a force stretches it")
    ] = 0.0

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
            bend_max_rad=self.bend_max_deg * DEG,
            length_rate_max_m_s=self.length_rate_max_mm_s * MM,
            length_acceleration_max_m_s2=self.length_acceleration_max_mm_s2 * MM,
            pressure_min_pa=self.pressure_min_bar * BAR,
            pressure_max_pa=self.pressure_max_bar * BAR,
            pressure_slew_max_pa_s=self.pressure_slew_max_bar_s * BAR,
            lengthening_m_per_pa=self.lengthening_mm_per_bar * MM / BAR,
            softening_m_per_pa2=self.softening_mm_per_bar2 * MM / BAR**2,
            coupling=self.coupling,
            hysteresis_pa=self.hysteresis_bar * BAR,
            bending_compliance_rad_per_n_m=self.bending_compliance_deg_per_n_m * DEG,
            axial_compliance_m_per_n=self.axial_compliance_mm_per_n * MM,
        )


class ResponseConfig(Table):
    """How the arm answers to a step of the pressures."""

    delay_ms: Annotated[
        float,
        Field(
            ge=0,
            le=500,
            description="dead time from the pressure sent to the first change in the chamber",
        ),
    ] = 5.0
    filling_lag_ms: Annotated[
        float,
        Field(
            ge=1,
            le=10000,
            description=(
                "first-order lag of valve and chamber while the pressure rises: the time in which "
                "it goes 63 % of its way, after the dead time"
            ),
        ),
    ] = 60.0
    exhausting_lag_ms: Annotated[
        float, Field(ge=1, le=10000, description="the same while the pressure falls")
    ] = 60.0
    mode_hz: Annotated[float, Field(gt=0, le=200, description="lowest bending mode of the arm")] = (
        2.2
    )
    damping_ratio: Annotated[float, Field(gt=0, le=2, description="of that mode")] = 0.15
    lead_max_bar: Annotated[
        float,
        Field(
            gt=0,
            le=10,
            description=(
                "how far a setpoint may run ahead of slow valves, besides what a lag of 80 ms asks "
                "for: more is faster; less lets valves follow that are slower somewhere than their "
                "lag, and the tip ends nearer to its target where no camera corrects it"
            ),
        ),
    ] = 0.04

    @model_validator(mode="before")
    @classmethod
    def _two_lags(cls, table: Any) -> Any:
        """Say what to write for the one lag of before."""
        if isinstance(table, dict) and "lag_ms" in table:
            lag = table["lag_ms"]
            raise ValueError(
                f"lag_ms = {lag}: there is one lag for each direction now; write "
                f"filling_lag_ms = {lag} and exhausting_lag_ms = {lag} in its place, or let "
                "`pneuarm calibrate` measure them"
            )
        return table

    def response(self) -> Response:
        """Return the response in SI units."""
        return Response(
            delay_s=self.delay_ms * 1e-3,
            filling_lag_s=self.filling_lag_ms * 1e-3,
            exhausting_lag_s=self.exhausting_lag_ms * 1e-3,
            mode_hz=self.mode_hz,
            damping_ratio=self.damping_ratio,
            lead_max_pa=self.lead_max_bar * BAR,
        )


def with_two_lags(arm: dict[str, Any]) -> dict[str, Any]:
    """Return a table of an arm with two lags, where it was recorded when there was one."""
    response = arm.get("response")
    if not isinstance(response, dict) or "lag_ms" not in response:
        return arm
    others = {key: value for key, value in response.items() if key != "lag_ms"}
    lags = {"filling_lag_ms": response["lag_ms"], "exhausting_lag_ms": response["lag_ms"]}
    # A lag of 0 was allowed; 1 ms is as good as none.
    lags = {key: max(value, 1.0) for key, value in lags.items()}
    return arm | {"response": lags | others}


Triple = Annotated[tuple[Finite, Finite, Finite], Field(strict=False)]


class KeepOutConfig(Table):
    """A place where no part of the arm may be; a sphere or a half-space, in the base frame."""

    shape: Annotated[
        Literal["sphere", "half_space"],
        Field(
            description=(
                "a sphere has `center_mm` and `radius_mm`, a half-space `normal` and `offset_mm`"
            )
        ),
    ]
    center_mm: Annotated[Triple | None, Field(description="centre of the sphere")] = None
    radius_mm: Annotated[Positive | None, Field(description="its radius")] = None
    normal: Annotated[
        Triple | None,
        Field(description="points into the forbidden side, of any length above 0"),
    ] = None
    offset_mm: Annotated[
        Finite | None, Field(description="distance of the plane from the base along `normal`")
    ] = None

    @model_validator(mode="after")
    def _its_own_keys(self) -> "KeepOutConfig":
        sphere, half_space = ("center_mm", "radius_mm"), ("normal", "offset_mm")
        own, other = (sphere, half_space) if self.shape == "sphere" else (half_space, sphere)
        missing = [key for key in own if getattr(self, key) is None]
        foreign = [key for key in other if getattr(self, key) is not None]
        if missing or foreign:
            raise ValueError(f"a {self.shape} has the keys {' and '.join(own)}, and no others")
        if self.normal is not None and not math.hypot(*self.normal) > 0.0:
            raise ValueError("normal = [0, 0, 0] points nowhere; it points into the forbidden side")
        return self

    def keep_out(self) -> KeepOut:
        """Return it in SI units."""
        if self.center_mm is not None and self.radius_mm is not None:
            x, y, z = self.center_mm
            return Sphere((x * MM, y * MM, z * MM), self.radius_mm * MM)
        x, y, z = self.normal or (0.0, 0.0, 1.0)
        norm = math.hypot(x, y, z)
        return HalfSpace((x / norm, y / norm, z / norm), (self.offset_mm or 0.0) * MM)


class ArmConfig(Table):
    """The arm: its name on the wire, gravity in its base frame, its sections from the base on."""

    name: Annotated[
        str,
        Field(
            pattern=ARM_NAME,
            description=(
                "the arm's name in all Zenoh keys and log files: lower case letters, digits, `_` "
                "and `-`, a letter first, at most 32"
            ),
        ),
    ]
    gravity_m_s2: Annotated[
        tuple[Finite, Finite, Finite],
        Field(
            strict=False,
            description=(
                "gravity in the base frame, z from base to tip: `[0.0, 0.0, 9.81]` hangs, `[0.0, "
                "0.0, -9.81]` stands, `[9.81, 0.0, 0.0]` lies sideways"
            ),
        ),
    ]
    body_radius_mm: Annotated[
        NotNegative,
        Field(
            description="how far the arm's skin is from the backbone; counts for `keep_outs` only",
        ),
    ] = 0.0
    keep_outs: Annotated[
        tuple[KeepOutConfig, ...],
        Field(max_length=16, strict=False, description="where no part of the arm may be"),
    ] = ()
    sections: Annotated[
        tuple[SectionConfig, ...],
        Field(
            min_length=1, max_length=16, strict=False, description="the sections, from the base on"
        ),
    ]
    mass_kg: Annotated[
        Positive,
        Field(description="mass of all sections together, spread evenly over their rest lengths"),
    ] = 1.0
    response: ResponseConfig = ResponseConfig()

    def build(self) -> Arm:
        """Return the arm in SI units."""
        return Arm(
            self.name,
            tuple(section.section() for section in self.sections),
            self.gravity_m_s2,
            self.mass_kg,
            self.response.response(),
            keep_outs=tuple(place.keep_out() for place in self.keep_outs),
            body_radius_m=self.body_radius_mm * MM,
        )
