"""A wrong configuration is refused with key, value and what is allowed; a right one loads."""

import contextlib
import os
import re
import tomllib
from errno import EISDIR, ENOENT
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import HalfSpace, Response, Sphere
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.controllers.controller import Controller
from pneuarm.service.cli.parser import PRESETS as CLI_PRESETS
from pneuarm.service.configuration.configuration import (
    PRESETS,
    Configuration,
    check,
    load,
    log_directory,
    recorded,
    rerun_url,
)
from pneuarm.service.configuration.tables.monitors import MOVED
from pneuarm.service.devices import registry

SECTION = load().model_dump()["arm"]["sections"][0]


def loaded(folder: Path, text: str) -> Configuration:
    path = folder / "own.toml"
    path.write_text(text)
    return load(path)


def refusals(folder: Path, text: str) -> list[str]:
    """What is said of a file, a line a mistake, each beginning with the file's name."""
    with pytest.raises(ConfigurationError) as caught:
        loaded(folder, text)
    lines = str(caught.value).splitlines()
    assert all(line.startswith(str(folder / "own.toml")) for line in lines)
    return [line.removeprefix(f"{folder / 'own.toml'}").lstrip(": ") for line in lines]


@pytest.mark.parametrize("preset", PRESETS)
def test_every_preset_loads_and_builds_an_arm(preset: str) -> None:
    configuration = load(preset=preset)
    arm = configuration.build_arm()
    assert (arm.name, configuration.preset) == (preset, preset)
    lengths = Controller(arm, configuration.control.settings()).lengths_m
    assert (lengths == arm.rest_lengths_m).all()


@pytest.mark.parametrize("preset", PRESETS)
def test_the_chambers_of_a_preset_end_where_equation_4_says(preset: str) -> None:
    for section in load(preset=preset).build_arm().sections:
        assert section.length_min_m == pytest.approx(0.5 * section.rest_length_m, rel=1e-12)
        assert section.length_max_m == pytest.approx(1.5 * section.rest_length_m, rel=1e-12)


@pytest.mark.parametrize("preset", PRESETS)
def test_what_is_shown_loads_to_the_same(tmp_path: Path, preset: str) -> None:
    configuration = load(preset=preset)
    assert loaded(tmp_path, configuration.to_toml()) == configuration


def test_the_command_line_knows_the_same_presets() -> None:
    assert CLI_PRESETS == PRESETS
    presets = files("pneuarm.service.configuration").joinpath("presets").iterdir()
    assert {path.name for path in presets} == {f"{name}.toml" for name in PRESETS}


def test_a_file_holds_only_what_differs(tmp_path: Path) -> None:
    own = loaded(tmp_path, 'preset = "table1"\n[control]\nrate_hz = 250\n[arm]\nname = "mine"\n')
    expected = load(preset="table1")
    assert (own.control.rate_hz, own.arm.name) == (250.0, "mine")
    assert own.arm.sections == expected.arm.sections
    assert own.control.model_copy(update={"rate_hz": 1000.0}) == expected.control


def test_the_command_lines_arm_goes_before_the_files(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text('preset = "table1"\n')
    assert load(tmp_path / "own.toml", "trunk").arm.name == "trunk"


def test_millimetres_degrees_and_bar_become_si() -> None:
    section = load(preset="table1").build_arm().sections[0]
    assert section.rest_length_m == pytest.approx(0.1717)
    assert section.bend_max_rad == pytest.approx(1.5707963)
    assert section.length_rate_max_m_s == pytest.approx(0.2)
    assert section.pressure_max_pa == pytest.approx(1.2e5)
    assert section.pressure_slew_max_pa_s == pytest.approx(6e5)
    assert section.lengthening_m_per_pa == pytest.approx(3.233e-7)
    assert section.softening_m_per_pa2 == pytest.approx(1.044e-12)


@pytest.mark.parametrize(
    ("text", "key", "beside"),
    [
        ("rate_hz = 1", "rate_hz", "control"),
        ("[control]\nrate = 1", "control.rate", "rate_hz"),
        ("[arm]\nsection = 1", "arm.section", "sections"),
        ("[hardware]\nip = 'x'", "hardware.ip", "device"),
        ("[log]\nroll_mb = 1", "log.roll_mb", "roll_mib"),
        ("[zenoh]\nconnect = []", "zenoh.connect", "listen"),
    ],
)
def test_an_unknown_key_is_refused_with_those_there_are(
    tmp_path: Path, text: str, key: str, beside: str
) -> None:
    (line,) = refusals(tmp_path, text)
    assert line.split(":")[0] == key
    assert beside in re.findall(r"\w+", line)


@pytest.mark.parametrize("old", MOVED)
def test_a_key_that_has_moved_is_refused_with_its_new_place(tmp_path: Path, old: str) -> None:
    (line,) = refusals(tmp_path, f"[monitors]\n{old} = 20.0")
    assert line.split(":")[0] == f"monitors.{old}"
    assert f"monitors.{MOVED[old]}" in re.findall(r"[\w.]+", line)
    table, _, name = MOVED[old].partition(".")
    assert name in type(getattr(load().monitors, table)).model_fields


def test_a_session_from_before_a_key_moved_is_read_with_its_values() -> None:
    now = load().model_dump(exclude_none=True)
    before = {old: 20.0 + number / 64.0 for number, old in enumerate(MOVED)}
    before["supply_margin_bar"] = 0.5
    text = tomli_w.dumps(now | {"monitors": before | {"ramp_bar_s": 0.7}})
    monitors = recorded(text, "session.mcap").monitors
    assert monitors.ramp_bar_s == 0.7
    for old, place in MOVED.items():
        table, _, name = place.partition(".")
        assert getattr(getattr(monitors, table), name) == before[old]
    assert recorded(tomli_w.dumps(now), "session.mcap") == load()


def test_an_unknown_key_of_a_section_too(tmp_path: Path) -> None:
    tables = {"arm": {"sections": [SECTION, SECTION | {"colour": "red"}]}}
    (line,) = refusals(tmp_path, tomli_w.dumps(tables))
    assert line.split(":")[0] == "arm.sections[1].colour"
    assert set(SECTION) <= set(re.findall(r"\w+", line))


#: A file, the key that the refusal begins with, and what it tells: the value, and what is allowed.
WRONG = [
    ("[control]\nrate_hz = 10", "control.rate_hz", ("10", "50")),
    ("[control]\nrate_hz = nan", "control.rate_hz", ("nan",)),
    ("[control]\nrate_hz = 'fast'", "control.rate_hz", ("'fast'", "number")),
    ("[control]\ntip_speed_max_mm_s = inf", "control.tip_speed_max_mm_s", ("inf", "finite")),
    ("[control]\nlaw = 'pid'", "control.law", ("'pid'", "'resolved_rate'", "'qp_ik'")),
    ("[control]\nrate_hz = '500'", "control.rate_hz", ("'500'", "number")),
    ("[rerun]\nenabled = 1", "rerun.enabled", ("1", "boolean")),
    ("[zenoh]\nlisten = ['localhost']", "zenoh.listen[0]", ("'localhost'", "tcp")),
    ("control = 3", "control", ("3",)),
    ("[hardware]\nadapter = 'festo'", "hardware.adapter", ("'festo'", "simulator", "festo-cpx")),
    ("[log]\nroll_mib = inf", "log.roll_mib", ("inf", "finite")),
    ("[log]\nkeep_gib = nan", "log.keep_gib", ("nan",)),
    ("[rerun]\nport = 70000", "rerun.port", ("70000", "65535")),
    ("[rerun]\nport = 1.5", "rerun.port", ("1.5", "integer")),
    ("[simulator]\nseed = -1", "simulator.seed", ("-1", "0")),
    ("[simulator]\nvalves = 'fast'", "simulator.valves", ("'fast'", "'servo'", "'itv'", "'onoff'")),
    ("[zenoh]\nlisten = []", "zenoh.listen", ("[]", "at least 1")),
    ("[arm]\nname = 'My Arm'", "arm.name", ("'My Arm'", "a-z")),
    ("[arm]\ngravity_m_s2 = [0, 0]", "arm.gravity_m_s2[2]", ("missing",)),
    ("preset = 'octopus'", "preset", ("'octopus'", *PRESETS)),
    ("preset = 3", "preset", ("3", *PRESETS)),
]


@pytest.mark.parametrize(("text", "key", "told"), WRONG)
def test_a_wrong_value_is_refused_with_key_value_and_what_is_allowed(
    tmp_path: Path, text: str, key: str, told: tuple[str, ...]
) -> None:
    (line,) = refusals(tmp_path, text)
    assert re.split(r" = |: | is ", line)[0] == key
    assert all(fact in line.removeprefix(key) for fact in told)


@pytest.mark.parametrize("text", ["a = ", "a = " + "[" * 5000])
def test_what_is_no_toml_is_refused(tmp_path: Path, text: str) -> None:
    (line,) = refusals(tmp_path, text)
    assert "TOML" in line


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"length_min_mm": 250.0},
            ("length_min_mm = 250", "rest_length_mm = 200"),
        ),
        (
            {"length_max_mm": 150.0},
            ("length_max_mm = 150", "rest_length_mm = 200"),
        ),
        ({"pressure_min_bar": 0.1}, ("pressure_min_bar = 0.1", "equal to 0")),
        ({"pressure_max_bar": -0.1}, ("pressure_max_bar = -0.1", "than 0")),
        ({"rest_length_mm": float("nan")}, ("rest_length_mm = nan",)),
        ({"bend_max_deg": 0}, ("bend_max_deg = 0", "than 0")),
    ],
)
def test_bounds_that_contradict_each_other_are_refused(
    tmp_path: Path, changes: dict[str, float], words: tuple[str, ...]
) -> None:
    text = tomli_w.dumps({"arm": {"sections": [SECTION | changes]}})
    (line,) = refusals(tmp_path, text)
    assert line.startswith("arm.sections[0]")
    assert all(word in line for word in words)


def test_every_mistake_is_said_at_once(tmp_path: Path) -> None:
    lines = refusals(tmp_path, "[control]\nrate_hz = 1\nspin = 2\n[rerun]\nport = 0\n")
    assert [line.split()[0] for line in lines] == ["control.rate_hz", "control.spin:", "rerun.port"]


def test_a_file_that_cannot_be_read_is_said(tmp_path: Path) -> None:
    (tmp_path / "binary.toml").write_bytes(os.urandom(8) + b"\xff\xfe")
    for name, why in (("none.toml", os.strerror(ENOENT)), ("", os.strerror(EISDIR))):
        with pytest.raises(ConfigurationError, match=why) as refused:
            load(tmp_path / name)
        assert str(tmp_path / name) in str(refused.value)
    with pytest.raises(ConfigurationError, match="UTF-8") as refused:
        load(tmp_path / "binary.toml")
    assert "binary.toml" in str(refused.value)


NAMES = st.sampled_from(
    [*Configuration.model_fields, *SECTION, "rate_hz", "listen", "port", "sections", "name", "0"]
) | st.text(max_size=5)
VALUES = st.recursive(
    st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.dates(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(NAMES, inner, max_size=4),
    max_leaves=10,
)


def loads_again(configuration: Configuration, path: Path) -> bool:
    path.write_text(configuration.to_toml())
    return load(path) == configuration


@given(st.dictionaries(NAMES, VALUES, max_size=4))
def test_whatever_a_file_says_it_is_loaded_or_refused(
    tmp_path_factory: pytest.TempPathFactory, tables: dict[str, object]
) -> None:
    path = tmp_path_factory.mktemp("any") / "own.toml"
    path.write_text(tomli_w.dumps(tables))
    with contextlib.suppress(ConfigurationError):
        assert loads_again(load(path), path)
    with contextlib.suppress(ConfigurationError):
        assert loads_again(check(tables), path)


def test_a_configuration_is_never_changed() -> None:
    with pytest.raises(ValueError, match="frozen"):
        load().control.rate_hz = 5.0  # type: ignore[misc]


def test_addresses(tmp_path: Path) -> None:
    one = load()
    assert registry.address(one) == "simulator:paper"
    two = loaded(tmp_path, "[hardware]\ndevice = 'bench'\n[rerun]\nbind = '0.0.0.0'\nport = 99\n")
    assert registry.address(two) == "simulator:bench"
    assert rerun_url(one) == "rerun+http://127.0.0.1:9876/proxy"
    assert rerun_url(two) == "rerun+http://127.0.0.1:99/proxy"
    assert log_directory(loaded(tmp_path, "[log]\ndirectory = '~/x'")) == Path.home() / "x"
    assert log_directory(one).name == "sessions"


def test_a_calibrated_section_and_response_become_si(tmp_path: Path) -> None:
    calibrated = SECTION | {
        "coupling": [[1.1, 0.0, 0.1], [0.0, 1.0, 0.0], [0.0, -0.1, 0.9]],
        "hysteresis_bar": 0.03,
        "bending_compliance_deg_per_n_m": 180.0,
        "axial_compliance_mm_per_n": 2.0,
    }
    tables = {
        "arm": {"sections": [calibrated], "mass_kg": 0.4, "response": {"filling_lag_ms": 80.0}}
    }
    arm = loaded(tmp_path, tomli_w.dumps(tables)).build_arm()
    section = arm.sections[0]
    assert section.coupling[0] == (1.1, 0.0, 0.1)
    assert section.hysteresis_pa == pytest.approx(3000.0)
    assert section.bending_compliance_rad_per_n_m == pytest.approx(np.pi)
    assert section.axial_compliance_m_per_n == pytest.approx(2e-3)
    response = arm.response
    assert arm.mass_kg == 0.4
    assert response == Response(delay_s=0.005, filling_lag_s=0.08, exhausting_lag_s=0.06)


def test_the_one_lag_of_before_is_refused_with_what_to_write_and_read_in_a_session(
    tmp_path: Path,
) -> None:
    old = "[arm.response]\nlag_ms = 80.0\n"
    (line,) = refusals(tmp_path, old)
    facts = ("lag_ms = 80", "filling_lag_ms = 80", "exhausting_lag_ms = 80", "pneuarm calibrate")
    assert [fact for fact in facts if fact not in line] == []
    tables = tomllib.loads(load().to_toml())
    for table in (tables["arm"], tables["simulator"].setdefault("arm", dict(tables["arm"]))):
        table["response"] = {"lag_ms": 0.0, "mode_hz": 2.0}
    told = recorded(tomli_w.dumps(tables), "a session")
    for arm in (told.build_arm(), told.build_simulated_arm()):
        assert (arm.response.filling_lag_s, arm.response.exhausting_lag_s) == (1e-3, 1e-3)
        assert arm.response.mode_hz == 2.0


def test_a_coupling_without_an_inverse_is_refused(tmp_path: Path) -> None:
    flat = SECTION | {"coupling": [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]}
    (line,) = refusals(tmp_path, tomli_w.dumps({"arm": {"sections": [flat]}}))
    assert "coupling = [[1.0, 0.0, 0.0], [1.0" in line
    assert "independent" in line


@pytest.mark.parametrize("table", ["simulator", "mujoco"])
def test_the_simulated_arm_may_differ_from_the_controlled_one(tmp_path: Path, table: str) -> None:
    hardware = {"adapter": table}
    real = load().model_dump(exclude_none=True)["arm"]
    believed = real | {"sections": [SECTION | {"rest_length_mm": 210.0}]}
    text = tomli_w.dumps({"arm": believed, "hardware": hardware, table: {"arm": real}})
    own = loaded(tmp_path, text)
    assert own.build_arm().sections[0].rest_length_m == pytest.approx(0.21)
    assert own.build_simulated_arm() == load().build_arm()
    assert loaded(tmp_path, own.to_toml()) == own
    two = real | {"sections": [SECTION, SECTION]}
    text = tomli_w.dumps({"hardware": hardware, table: {"arm": two}})
    (line,) = refusals(tmp_path, text)
    assert re.search(rf"{table}\.arm .*2 sections.* arm .*1", line)


WALL = {"shape": "half_space", "normal": [0.0, 0.0, 2.0], "offset_mm": 320.0}


def with_keep_outs(*places: dict[str, object], **arm: object) -> dict[str, object]:
    preset = files("pneuarm.service.configuration").joinpath("presets", "paper.toml")
    tables = tomllib.loads(preset.read_text())
    tables["arm"] |= {"keep_outs": list(places), **arm}
    return tables


def test_keep_outs_become_the_arms_in_metres() -> None:
    ball = {"shape": "sphere", "center_mm": [100.0, 0.0, 200.0], "radius_mm": 30.0}
    configuration = check(with_keep_outs(WALL, ball, body_radius_mm=45.0))
    assert check(tomllib.loads(configuration.to_toml())) == configuration
    arm = configuration.build_arm()
    assert arm.keep_outs == (HalfSpace((0.0, 0.0, 1.0), 0.32), Sphere((0.1, 0.0, 0.2), 0.03))
    assert arm.body_radius_m == pytest.approx(0.045)


@pytest.mark.parametrize(
    ("place", "said"),
    [
        (WALL | {"radius_mm": 3.0}, ("half_space", "normal", "offset_mm")),
        ({"shape": "sphere", "radius_mm": 3.0}, ("sphere", "center_mm", "radius_mm")),
        (WALL | {"normal": [0.0, 0.0, 0.0]}, ("keep_outs[0]", "normal = [0, 0, 0]")),
        (WALL | {"shape": "cube"}, ("arm.keep_outs[0].shape", "'cube'", "sphere", "half_space")),
        (WALL | {"offset_mm": 190.0}, ("keep_outs[0]", "section 1")),
    ],
)
def test_a_wrong_keep_out_is_refused(place: dict[str, object], said: tuple[str, ...]) -> None:
    with pytest.raises(ConfigurationError) as refused:
        check(with_keep_outs(place))
    assert all(fact in str(refused.value) for fact in said)
