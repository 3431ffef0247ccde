"""Where the contacts of the monitor are, and the bias that it follows."""

from dataclasses import replace

import numpy as np
import pytest

from tactful import Monitor, MonitorConfig, Recording, Robot
from tactful.dynamics import Dynamics
from tactful.evaluation import InjectedContact, inject
from tactful.isolation import Isolator
from tactful.monitor._locator import SETTLED_S
from tactful.robots import Frame
from tests.monitor._touched import recording

CALIBRATED = MonitorConfig(noise={"model_nm": 0.1, "torque_nm": 0.05, "velocity_rad_s": 0.001})


@pytest.fixture(scope="module")
def panda() -> Robot:
    """An arm whose surface is known."""
    return Robot.load("panda")


@pytest.fixture(scope="module")
def swing(panda: Robot) -> Recording:
    """Three seconds without a contact."""
    return recording(panda, duration_s=3.0, noise_nm=0.02)


def on_link(
    robot: Robot, samples: Recording, link: int, start_s: float, end_s: float, size_n: float = 20.0
) -> InjectedContact:
    """Return a push along the inward normal in the middle of a capsule of a link."""
    assert samples.q is not None
    capsule = max(
        (c for c in robot.capsules if c.link == link), key=lambda c: np.linalg.norm(np.subtract(c.p1_m, c.p0_m))
    )
    p0, p1 = np.array(capsule.p0_m), np.array(capsule.p1_m)
    axis = (p1 - p0) / max(float(np.linalg.norm(p1 - p0)), 1e-9)
    outward = np.cross(axis, [0.3, 1.0, 0.2])
    outward /= np.linalg.norm(outward)
    point = (p0 + p1) / 2 + capsule.radius_m * outward
    q = samples.q[np.searchsorted(samples.t, start_s)]
    framed = replace(robot, frames={**robot.frames, "touched": Frame(link, np.eye(3), np.zeros(3))})
    R = Dynamics(framed).pose(q, "touched")[0]
    force = -size_n * R @ outward
    return InjectedContact(
        kind="push",
        start_s=start_s,
        end_s=end_s,
        force_n=(float(force[0]), float(force[1]), float(force[2])),
        link=link,
        point_m=(float(point[0]), float(point[1]), float(point[2])),
        rise_s=0.05,
    )


@pytest.mark.parametrize("link", [4, 5, 6])
def test_the_touched_link_is_named(panda: Robot, swing: Recording, link: int) -> None:
    """The monitor says which link is touched, where and how hard, on the links where seven torques tell it."""
    touched = inject(swing, panda, [on_link(panda, swing, link, 1.2, 2.2)])
    (event,) = Monitor(panda, CALIBRATED).run(touched)
    assert event.link == panda.link_names[link]
    assert event.location is not None
    assert not event.location.ambiguous
    assert event.location.confidence > 0.9
    assert event.location.magnitude_n == pytest.approx(20.0, rel=0.25)
    low, high = event.location.magnitude_interval_n
    assert low < event.location.magnitude_n < high
    assert event.to_dict()["location"]["link"] == event.link


def test_no_link_is_claimed_before_the_torque_has_settled(panda: Robot, swing: Recording) -> None:
    """At the detection most of the torque is still on its way: the link comes later, and is looked for each 10 ms."""
    touched = inject(swing, panda, [on_link(panda, swing, 5, 1.2, 2.2, 40.0)])
    assert touched.q is not None
    assert touched.dq is not None
    assert touched.tau is not None
    monitor = Monitor(panda, CALIBRATED)
    looks, events = 0, []
    isolator = Isolator.locate

    def counted(self: Isolator, *args: object) -> object:
        nonlocal looks
        looks += 1
        return isolator(self, *args)  # type: ignore[arg-type]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Isolator, "locate", counted)
        for k in range(len(touched.t)):
            event = monitor.update(touched.t[k], touched.q[k], touched.dq[k], touched.tau[k])
            if event is not None:
                events.append((touched.t[k], event))
    assert events[0][1].link is None
    named = next(t for t, event in events if event.link is not None)
    assert SETTLED_S <= named - events[0][1].onset_s < 0.1
    lasted = events[-1][0] - events[0][0]
    assert looks == pytest.approx(lasted / 0.01, abs=4)


def test_an_arm_without_a_surface_has_no_location(panda: Robot, swing: Recording) -> None:
    """What is not known is not invented: no capsules, no link."""
    bare = replace(panda, capsules=())
    touched = inject(swing, panda, [on_link(panda, swing, 5, 1.2, 2.2)])
    (event,) = Monitor(bare, CALIBRATED).run(touched)
    assert event.link is None
    assert event.location is None


def test_a_slow_bias_is_followed_within_bounds_and_not_in_contact(panda: Robot) -> None:
    """A sensor that drifts makes no force; a drift beyond the bound stays visible; a contact is no drift."""
    still = recording(panda, duration_s=8.0, speed_rad_s=0.0)
    assert still.tau is not None

    def followed(offset_nm: float, push: bool = False) -> tuple[float, ...]:
        samples = replace(still, channels={**still.channels, "tau": still.tau - offset_nm * np.eye(7)[1]})
        if push:
            samples = inject(samples, panda, [on_link(panda, samples, 5, 1.0, 7.9)])
        config = CALIBRATED.model_copy(update={"fast": CALIBRATED.fast.model_copy(update={"bias_s": 1.0})})
        return Monitor(panda, config).run(samples).bias_nm

    assert followed(0.1)[1] == pytest.approx(0.1, abs=0.005)
    assert followed(5.0)[1] == 0.2  # two standard deviations of the model's error
    assert abs(followed(0.0, push=True)[3]) < 0.01


def test_a_wrench_tells_no_place() -> None:
    """An arm with six joints has as many torques as a wrench has components: they are not to be taken for them."""
    arm = Robot.load("ur5e")
    noise = {name: (0.1,) * 6 for name in ("model_nm", "torque_nm")}
    t = np.arange(3000) / 1000
    wrench = np.where((t > 1.5)[:, None], [0.0, 0.0, -25.0, 0.0, 0.0, 0.0], 0.0)
    touched = Recording(t=t, channels={"wrench": wrench}, source="wrench.csv", format="made")
    for robot in (arm, Robot.load("panda")):
        (event,) = Monitor(robot, MonitorConfig(source="wrench", noise=noise)).run(touched)
        assert event.location is None
