"""`pneuarm workspace`: what it prints, what it writes, and what it says when it cannot."""

import json
import os
import re
from errno import ENOTDIR
from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.workspace.mesh import Mesh
from pneuarm.controllers.workspace.workspace import Workspace
from pneuarm.service.cli.parser import main
from pneuarm.service.configuration.configuration import load
from pneuarm.service.workspace.picture import plane_section
from pneuarm.service.workspace.poses import typical_lengths


def read_ply(path: Path) -> Mesh:
    """Read what the header says, no more."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    words = header.decode("ascii").splitlines()
    vertices, faces = (int(line.split()[-1]) for line in words if line.startswith("element"))
    assert words[:2] == ["ply", "format binary_little_endian 1.0"]
    points = np.frombuffer(body[: 24 * vertices], "<f8").reshape(-1, 3)
    rows = np.frombuffer(body[24 * vertices :], np.dtype([("n", "u1"), ("v", "<i4", (3,))]))
    assert len(rows) == faces
    assert (rows["n"] == 3).all()
    return Mesh(points, rows["v"].astype(np.int64))


def test_the_table_has_the_figures_and_the_json_the_same(capsys: pytest.CaptureFixture) -> None:
    assert main(["workspace", "--samples", "2000"]) == 0
    text = capsys.readouterr().out
    assert main(["workspace", "--samples", "2000", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["exact"]
    assert said["arm"] == "paper"
    assert f"{said['volume_litres']:.7g} litres" in text
    assert said["volume_error_litres"] < 1e-4 * said["volume_litres"]
    for check in said["volume_checks"]:
        assert abs(check["volume_litres"] - said["volume_litres"]) <= check["error_litres"]
    low, high = said["extents_mm"]
    assert f"z {low[2]:.2f} to {high[2]:.2f}" in text
    assert high[2] == pytest.approx(300.0, abs=0.01)
    assert said["limits"][0]["length_mm"] == pytest.approx([100.0, 300.0], abs=0.01)
    assert said["limits"][0]["shortest_by"] == said["limits"][0]["longest_by"] == "length"
    assert said["limits"][0]["bend_max_deg"] == pytest.approx(150.0)
    assert said["least_radius_over_offset"][0] > 1.0
    assert said["mesh"]["watertight"]
    assert said["files"] == []


def test_the_arm_without_vacuum_is_said_to_be_bound_by_its_pressure(
    capsys: pytest.CaptureFixture,
) -> None:
    assert main(["workspace", "--arm", "table1", "--samples", "100"]) == 0
    text = capsys.readouterr().out
    assert re.search(r"171\.7 mm .*pressure.* 225\.5 mm .*pressure", text)


def test_several_sections_are_said_to_be_numerical(capsys: pytest.CaptureFixture) -> None:
    assert main(["workspace", "--arm", "trunk", "--samples", "200"]) == 0
    text = capsys.readouterr().out
    assert "not exact" in text
    assert "outer hull" in text
    assert len(re.findall(r"100\.0 mm .*length", text)) == 3


def test_mesh_samples_and_recording_are_written(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    out = tmp_path / "new" / "folder"
    assert main(["workspace", "--samples", "500", "--out", str(out), "--json"]) == 0
    captured = capsys.readouterr()
    said = json.loads(captured.out)
    assert said["files"] == [
        str(out / f"workspace.{suffix}") for suffix in ("ply", "npz", "rrd", "png")
    ]
    assert captured.err == ""
    mesh = read_ply(out / "workspace.ply")
    assert mesh.is_watertight
    assert 1e3 * mesh.volume_m3 == pytest.approx(said["mesh"]["volume_litres"])
    samples = np.load(out / "workspace.npz")
    arm = load(preset="paper").build_arm()
    assert Workspace(arm).contains(samples["positions_m"]).all()
    assert len(samples["lengths_m"]) == len(samples["condition"]) == said["samples"]
    assert (out / "workspace.rrd").read_bytes()[:3] == b"RRF"


def test_the_picture_is_written(tmp_path: Path) -> None:
    from PIL import Image

    assert main(["workspace", "--samples", "200", "--out", str(tmp_path)]) == 0
    with Image.open(tmp_path / "workspace.png") as image:
        assert image.width > 1200
        pixels = np.asarray(image.convert("RGB")).astype(int)
    red, blue = pixels[..., 0] - pixels[..., 2] > 100, pixels[..., 2] - pixels[..., 0] > 100
    left = slice(0, image.width // 2)
    assert red[:, left].sum() > 500  # long chambers
    assert blue[:, left].sum() > 500  # short ones


def test_a_folder_that_cannot_be_made_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    (tmp_path / "file").write_text("")
    assert main(["workspace", "--samples", "50", "--out", str(tmp_path / "file" / "x")]) == 1
    said = capsys.readouterr().err
    assert f"--out {tmp_path / 'file' / 'x'}" in said
    assert os.strerror(ENOTDIR) in said


def test_a_senseless_number_of_samples_is_one_sentence(capsys: pytest.CaptureFixture) -> None:
    assert main(["workspace", "--samples", "-3"]) == 2
    said = capsys.readouterr().err
    assert "--samples" in said
    assert "-3" in said


@pytest.mark.parametrize("preset", ["paper", "table1", "trunk"])
def test_the_arms_drawn_keep_their_limits_and_differ(preset: str) -> None:
    from pneuarm.controllers.limits.limits import Limits

    arm = load(preset=preset).build_arm()
    poses = typical_lengths(arm)
    for lengths in poses:
        np.testing.assert_allclose(Limits(arm).clip(lengths), lengths, atol=1e-9)
    assert len({tuple(np.round(lengths.ravel(), 6)) for lengths in poses}) >= 7


def test_the_line_in_the_picture_is_where_the_surface_meets_the_plane() -> None:
    across = np.array([[[0.0, -1.0, 0.0], [2.0, 1.0, 0.0], [0.0, -1.0, 4.0]]])
    aside = across + np.array([0.0, 5.0, 0.0])
    lines = plane_section(np.concatenate([across, aside]))
    assert lines.shape == (1, 2, 3)
    np.testing.assert_allclose(sorted(lines[0].tolist()), [[1.0, 0.0, 0.0], [1.0, 0.0, 2.0]])
    assert plane_section(aside).shape == (0, 2, 3)
