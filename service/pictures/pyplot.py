"""Matplotlib, loaded late: only pictures need it, and who draws none need not install it."""

from typing import Any

from pneuarm.controllers.arm.errors import NotInstalled


def pyplot() -> Any:
    """Return `matplotlib.pyplot`, drawing into files without a display; raises NotInstalled."""
    try:
        import matplotlib
    except ModuleNotFoundError as error:
        raise NotInstalled(
            "pictures are drawn with Matplotlib, which is not installed; in the checkout of "
            "pneuarm: pip install ./distributions/client '.[pictures]'"
        ) from error
    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot
