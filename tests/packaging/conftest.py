"""Both distributions, built from a copy of the checkout, straight and by way of their sdist."""

from pathlib import Path

import pytest

from tests.packaging.building import Built, build_both


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    return build_both(tmp_path_factory.mktemp("distributions"))


@pytest.fixture(scope="session")
def wheels(built: Built) -> tuple[Path, Path]:
    """Wheels of client and daemon, the ones that come from an sdist."""
    return built["pneuarm-client"].from_sdist, built["pneuarm"].from_sdist
