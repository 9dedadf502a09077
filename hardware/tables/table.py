"""What every table of a configuration file is, and the kinds of number in it."""

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

#: No quantity of an arm is larger, or smaller and not zero, in any unit of a configuration: what
#: lies beyond would overflow in a product long after it was accepted.
LARGEST, SMALLEST = 1e9, 1e-9

Positive = Annotated[float, Field(ge=SMALLEST, le=LARGEST, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST, allow_inf_nan=False)]
Finite = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]


def _known_home(text: str) -> str:
    try:
        Path(text).expanduser()
    except RuntimeError as error:
        raise ValueError(f"{text!r}: nobody of that name has a home folder here") from error
    return text


#: The path of a file or a folder; `~` is understood.
PathText = Annotated[
    str, Field(max_length=1024, pattern=r"^[^\x00-\x1f\x7f]*$"), AfterValidator(_known_home)
]

MM, BAR, DEG = 1e-3, 1e5, 0.017453292519943295


class Table(BaseModel):
    """A table of the file: unknown keys are errors, values are never changed afterwards."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
