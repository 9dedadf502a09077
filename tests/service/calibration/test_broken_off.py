"""What is kept of a calibration that was broken off: whole again, or refused in one sentence."""

import random
from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.service.calibration import broken_off
from pneuarm.service.calibration.drive import Progressed
from pneuarm.service.configuration.configuration import load

CONFIGURATION = load()


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    rng = np.random.default_rng(0)
    recording = Recording(
        np.arange(50) * 0.01,
        rng.normal(size=(50, 1, 3)),
        rng.normal(size=(50, 1, 3)),
        rng.normal(size=(50, 3)),
        rng.normal(size=(50, 3, 3)),
    )
    broken_off.save(tmp_path, CONFIGURATION, Progressed(3, [recording]))
    return tmp_path / broken_off.NAME


def test_what_was_kept_is_read_again(kept: Path) -> None:
    found = broken_off.load(kept.parent, CONFIGURATION)
    assert found.moves_done == 3
    assert found.recording.tip_m.shape == (50, 3)


@pytest.mark.parametrize("content", [b"", b"x", b"PK\x05\x06", b"\x93NUMPY", b"\0" * 1000])
def test_what_is_no_archive_is_refused(kept: Path, content: bytes) -> None:
    kept.write_bytes(content)
    assert_refused(kept)


def test_any_damage_is_refused_or_changes_nothing(kept: Path) -> None:
    chance, whole = random.Random(1), kept.read_bytes()
    before = broken_off.load(kept.parent, CONFIGURATION).recording
    refused = 0
    for _ in range(300):
        harmed = bytearray(whole[: chance.choice((len(whole), chance.randrange(len(whole))))])
        for _ in range(chance.randrange(1, 4) if harmed else 0):
            harmed[chance.randrange(len(harmed))] ^= 1 << chance.randrange(8)
        kept.write_bytes(harmed)
        try:
            found = broken_off.load(kept.parent, CONFIGURATION)
        except CalibrationError:
            refused += 1
            assert_refused(kept)
        else:
            assert found.moves_done == 3
            np.testing.assert_array_equal(found.recording.tip_m, before.tip_m)
            np.testing.assert_array_equal(found.recording.sent_pa, before.sent_pa)
    assert refused > 200


def assert_refused(kept: Path) -> None:
    with pytest.raises(CalibrationError) as caught:
        broken_off.load(kept.parent, CONFIGURATION)
    told = str(caught.value)
    assert all(fact in told for fact in (str(kept), "damaged", "--resume"))
    assert "\n" not in told
