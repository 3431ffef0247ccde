"""Layouts: other people's columns, by mapping files and by those that come with the package."""

import json
from pathlib import Path

import numpy as np
import pytest

from tactful.recordings import CHANNELS, Recording, RecordingError
from tactful.recordings._layout import UNITS, builtin, find, parse
from tests._counterparts import require_shared_data
from tests.recordings._make import motion

HEADERLESS = "0,90,1000,1,2\n100,91,1000,1,2\n200,92,1000,1,2\n"
MAPPING = """
title = "two columns and a current"
notes = ["made up"]
[time]
column = 0
unit = "ms"
[channels]
q = { columns = [1], unit = "deg" }
tau = { columns = { first = 2, count = 1 }, unit = "mNm", scale = -1.0 }
current = { columns = [3] }
[[labels]]
column = 4
kind = "contact"
"""


def test_mapping_by_place_unit_and_sign(tmp_path: Path) -> None:
    """All that a mapping can do, on a file without a header."""
    (tmp_path / "run.txt").write_text(HEADERLESS)
    (tmp_path / "My Arm.toml").write_text(MAPPING)
    recording = Recording.read(tmp_path / "run.txt", mapping=tmp_path / "My Arm.toml")
    np.testing.assert_allclose(recording.t, [0.0, 0.1, 0.2])
    np.testing.assert_allclose(recording.channels["q"], np.deg2rad([[90], [91], [92]]))
    np.testing.assert_allclose(recording.channels["tau"], [[-1], [-1], [-1]])
    assert recording.format == "csv/my-arm"
    assert recording.labels[0].kind == "contact"
    assert "made up" in recording.notes


def test_pattern_list_and_axes(tmp_path: Path) -> None:
    """Names by pattern, and axes in another order by the order of their names."""
    (tmp_path / "run.csv").write_text(
        "stamp_x,j1.pos,j2.pos,Fz,Fy,Fx,Tx,Ty,Tz\n0,1,2,3,4,5,6,7,8\n0.1,1,2,3,4,5,6,7,8\n"
    )
    mapping = {
        "time": {"column": "stamp_x"},
        "channels": {
            "q": {"columns": "j{i}.pos"},
            "wrench": {"columns": ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"], "scale": [1, 1, -1, 1, 1, -1]},
        },
    }
    recording = Recording.read(tmp_path / "run.csv", mapping=mapping)
    np.testing.assert_array_equal(recording.channels["q"][0], [1, 2])
    np.testing.assert_array_equal(recording.channels["wrench"][0], [5, 4, -3, 6, 7, -8])


def test_stated_units_are_not_judged(tmp_path: Path) -> None:
    """Who writes a mapping knows the units: 1 Hz in s stays 1 Hz, 20 rad stay 20 rad."""
    (tmp_path / "run.csv").write_text("time,q_0\n0,20\n1,20\n2,20\n")
    mapping = {"time": {"column": "time"}, "channels": {"q": {"columns": "q_{i}"}}}
    recording = Recording.read(tmp_path / "run.csv", mapping=mapping)
    assert recording.rate_hz == 1.0
    assert recording.channels["q"][0, 0] == 20.0


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "time: Field required"),
        ("[time", "no TOML"),
        ('[time]\ncolum = "t"\n[channels]\nq = { columns = "q" }', "did you mean 'column'"),
        ('[time]\ncolumn = "t"\nunit = "h"\n[channels]\nq = { columns = "q" }', "time.unit"),
        ('[time]\ncolumn = "t"\n[channels]\nqq = { columns = "q" }', "unknown channel 'qq': did you mean 'q'"),
        ('[time]\ncolumn = "t"\n[channels]\nq = { columns = "q", unit = "m" }', "use rad, deg"),
        ('[time]\ncolumn = "t"\n[channels]\ntau = { columns = "i", unit = "A" }', "torque constants"),
        ('[time]\ncolumn = "t"\n[channels]\nq = { columns = "q", scale = 0.0 }', "other than 0"),
        ('[time]\ncolumn = "t"\n[channels]\nq = { colums = "q" }', "did you mean 'columns'"),
        ('[time]\ncolumn = "t"\n[channels]', "channels"),
        ('[time]\ncolumn = "zeit"\n[channels]\nq = { columns = "q_0" }', "there is no column 'zeit'"),
        ('[time]\ncolumn = "time"\n[channels]\nq = { columns = "Q_{i}" }', "there is no column 'Q_0'"),
        ('[time]\ncolumn = "time"\n[channels]\nq = { columns = "q_{i}", scale = [1, 2, 3] }', "2 columns but 3 values"),
        ('[time]\ncolumn = "time"\n[channels]\nq = { columns = [1, 9] }', "there is no column 9"),
        ('[time]\ncolumn = "time"\n[channels]\nwrench = { columns = "q_{i}" }', "a wrench has 6"),
        ('[time]\ncolumn = "time"\n[channels]\ndq = { columns = "a{i}" }', "'a1' is missing|no column 'a1'"),
    ],
)
def test_broken_mapping(tmp_path: Path, text: str, says: str) -> None:
    """A mapping is written by hand: each slip is one line with the nearest right word."""
    (tmp_path / "run.csv").write_text("time,q_0,q_1,a0,a2\n0,1,1,1,1\n")
    (tmp_path / "m.toml").write_text(text)
    with pytest.raises(RecordingError, match=says) as caught:
        Recording.read(tmp_path / "run.csv", mapping=tmp_path / "m.toml")
    assert "\n" not in str(caught.value)


def test_missing_mapping_names_those_that_come_along(tmp_path: Path) -> None:
    """`--mapping ur` should lead to the name that was meant."""
    (tmp_path / "run.csv").write_text("time,q_0\n0,1\n")
    with pytest.raises(RecordingError, match="one of libfranka, panda_py, tactile_pad, ur_currents"):
        Recording.read(tmp_path / "run.csv", mapping="ur")


def test_every_channel_has_units() -> None:
    """A channel without a table of units could not be mapped."""
    assert set(UNITS) == set(CHANNELS)


def test_builtin_layouts_are_found() -> None:
    """Discovery counts: a layout that is not found is a format that silently is not read."""
    assert [layout.name for layout in builtin()] == ["libfranka", "panda_py", "tactile_pad", "ur_currents"]
    assert all(layout.match is not None and layout.title for layout in builtin())


@pytest.mark.parametrize("blank", ["", " "])
def test_libfranka_log(tmp_path: Path, blank: str) -> None:
    """The header of franka::logToCSV, old (with blanks) and new: time in ms, tau_ext with libfranka's sign."""
    n = range(7)
    fields = ["q", "q_d", "dq", "dq_d", "tau_J", "tau_ext_hat_filtered"]
    header = ["time", "success_rate", *(f"state.{field}[{i}]" for field in fields for i in n)]
    header += [f"cmd.tau_J_d[{i}]" for i in n]
    recording = motion(rows=50, joints=7)
    q, dq, tau = (recording.channels[name] for name in ("q", "dq", "tau"))
    table = np.column_stack([recording.t * 1e3 + 5000, np.ones(50), q, q, dq, dq, tau, np.full((50, 7), 0.5), tau])
    rows = [",".join(map(repr, row)) for row in table.tolist()]
    (tmp_path / "log.csv").write_text("\n".join([f",{blank}".join(header), *rows, ""]))
    back = Recording.read(tmp_path / "log.csv")
    assert back.format == "csv/libfranka"
    np.testing.assert_allclose(back.t, recording.t + 5.0)
    np.testing.assert_array_equal(back.q, q)
    np.testing.assert_array_equal(back.tau, tau)
    np.testing.assert_array_equal(back.tau_ext, np.full((50, 7), -0.5))


@pytest.mark.parametrize("suffix", ["json", "npz"])
def test_panda_py_log(tmp_path: Path, suffix: str) -> None:
    """`Panda.get_log()` is a dict of lists of arrays, time too; users save it as JSON or as NPZ."""
    recording = motion(rows=50, joints=7)
    log = {
        "O_F_ext_hat_K": np.full((50, 6), 2.0),
        "O_T_EE": np.zeros((50, 16)),
        "control_command_success_rate": np.ones((50, 1)),
        "dq": recording.channels["dq"],
        "q": recording.channels["q"],
        "tau_J": recording.channels["tau"],
        "tau_ext_hat_filtered": np.full((50, 7), 0.5),
        "time": recording.t[:, None] * 1e3,
    }
    path = tmp_path / f"log.{suffix}"
    if suffix == "json":
        path.write_text(json.dumps({name: values.tolist() for name, values in log.items()}))
    else:
        np.savez(path, **log)  # type: ignore[arg-type]
    back = Recording.read(path)
    assert back.format == f"{suffix}/panda_py"
    np.testing.assert_allclose(back.t, recording.t)
    np.testing.assert_array_equal(back.dq, recording.dq)
    np.testing.assert_array_equal(back.wrench, np.full((50, 6), -2.0))
    assert any("O_T_EE" in note for note in back.notes)


def test_documented_mapping_is_one() -> None:
    """The mapping in the documentation works as it stands there."""
    page = (Path(__file__).parents[2] / "docs" / "recordings.md").read_text(encoding="utf-8")
    for block in page.split("```toml\n")[1:]:
        parse(block.split("```")[0], Path("docs.toml"))


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_tactile_pad(number: int) -> None:
    """Real presses: the robot's estimate follows the sensor, and tau_ext has the sign of the environment."""
    recording = Recording.read(require_shared_data() / "panda_tactile_pad" / f"data_pos_{number}.csv")
    assert recording.format == "csv/tactile_pad"
    assert recording.t[0] == 0.0
    assert recording.rate_hz == pytest.approx(80.0, rel=1e-3)
    assert recording.q is None
    wrench, sensor = recording.channels["wrench"], recording.channels["wrench_ft"]
    assert np.corrcoef(wrench[:, 2], sensor[:, 2])[0, 1] > 0.95
    jacobian = recording.channels["jacobian"][0].reshape(6, 7)
    pressed = sensor[:, 2] < -2.5
    change = recording.channels["tau_ext"][pressed].mean(0) - recording.channels["tau_ext"][
        np.abs(sensor[:, 2]) < 0.15
    ].mean(0)
    up = jacobian[3:, 0]  # the first joint's axis, in the axes of the Jacobian
    assert np.linalg.pinv(jacobian.T)[:3] @ change @ up < -2.5


@pytest.mark.parametrize("name", ["no_torque", "ur_static_first_half"])
def test_ur_currents(name: str) -> None:
    """Real currents: torque is current times constant, and gravity has the sign of the target moment."""
    path = require_shared_data() / "ur_pushes" / f"{name}.csv"
    recording = Recording.read(path)
    assert recording.format == "csv/ur_currents"
    assert recording.n_joints == 6
    assert recording.rate_hz == pytest.approx(100.0, rel=1e-3)
    np.testing.assert_allclose(recording.channels["tau"][:, 1], 10.7 * recording.channels["current"][:, 1])
    moment = np.loadtxt(path, delimiter=",", usecols=(26, 27))
    mean = recording.channels["tau"][:, 1:3].mean(0)
    assert np.all(mean / moment.mean(0) > 0.6)
    assert np.all(mean / moment.mean(0) < 1.1)


def test_free_motion_is_canonical() -> None:
    """A real Panda under the canonical names: nothing is converted, stale rows and gaps are counted."""
    recording = Recording.read(require_shared_data() / "panda_free_motion" / "exciting_first_10s.csv")
    assert recording.format == "csv"
    assert recording.notes == ()
    assert set(recording.channels) == {"q", "dq", "tau"}
    assert recording.quality.repeated_rows == 540
    assert recording.quality.gaps == 2


def test_headerless_file_of_another_width_has_no_layout(tmp_path: Path) -> None:
    """Only the width that is known is taken for a UR log; any other needs a mapping."""
    (tmp_path / "run.csv").write_text(",".join("1" * 30) + "\n" + ",".join("1" * 30) + "\n")
    with pytest.raises(RecordingError, match="give a mapping"):
        Recording.read(tmp_path / "run.csv")
    assert find.__doc__
