"""The benchmark of the exchange runs and says what it is asked to."""

from tools.bench import modbus


def test_every_figure_is_there() -> None:
    figures = modbus.figures(2, exchanges=10)
    for name in ("exchanges_per_s", "library_exchanges_per_s", "share_of_library"):
        value = figures[name]
        assert isinstance(value, float)
        assert value > 0.0
