"""What every table of a configuration file is, and the kinds of number in it."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]

MM, BAR, DEG = 1e-3, 1e5, 0.017453292519943295


class Table(BaseModel):
    """A table of the file: unknown keys are errors, values are never changed afterwards."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
