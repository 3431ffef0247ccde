"""What reactions are worth over libfranka's protocol.

python -m tests.live.franka_reactions [COLLISIONS]

The real client commands a simulated FR3 on loopback, which runs into a post. Place and hardness of the post and the
speed are drawn; all reactions meet the same collisions. Prints the table of `docs/live_franka.md`.
"""

import sys

import numpy as np
from rich.progress import track

from tactful import MonitorConfig, Robot
from tactful.control import MinimumJerkPath, Pose
from tactful.dynamics import Dynamics
from tactful.live import Session, open_source
from tactful.reaction import load_policy
from tests.live._scenes import Scene
from tests.live._served import serve

POLICIES = ("continue", "stop", "retract", "comply")
CONFIG = MonitorConfig(noise={"velocity_rad_s": 0.001, "torque_nm": 0.05, "model_nm": 0.2})
_WAY_M, _START_S, _AFTER_S = 0.3, 0.8, 1.2


def collide(number: int, policy: str) -> tuple[float, float]:
    """Return the peak force [N] and the time in contact [s] of a drawn collision."""
    rng = np.random.default_rng(number)
    scene = Scene(obstacle=True, reach_m=rng.uniform(0.08, 0.2), contact_time_s=rng.uniform(0.01, 0.04))
    way_s = rng.uniform(1.5, 3.0)
    robot = Robot.load("fr3")
    start = Pose(*Dynamics(robot).pose(robot.home))
    there = Pose(start.rotation, start.position_m + np.array([0.0, _WAY_M, 0.0]))
    plan = MinimumJerkPath([(_START_S, start), (_START_S + way_s, there)])
    with serve("_franka_server", scene) as arm:
        source = open_source(f"franka://{arm.host}", CONFIG, react=True)
        session = Session(source, policy=load_policy(policy), plan=plan.pose)
        session.open()
        report = session.run(_START_S + way_s + _AFTER_S)
    assert report.problem is None, report.problem
    assert arm.truth is not None
    hits = [contact for contact in arm.truth["contacts"] if contact["kind"] == "collision"]
    return max(hit["peak_force_n"] for hit in hits), sum(hit["end_s"] - hit["touch_s"] for hit in hits)


def main(collisions: int) -> None:
    """Print the table."""
    runs = [(number, policy) for number in range(collisions) for policy in POLICIES]
    found = [collide(*run) for run in track(runs, "colliding", disable=not sys.stderr.isatty())]
    figures = np.array(found).reshape(collisions, len(POLICIES), 2)
    print(f"{collisions} collisions\n\n| reaction | peak force [N] | its share of that without | time in contact [s] |")
    print("| --- | --- | --- | --- |")
    for policy, (peak, contact_s) in zip(POLICIES, figures.transpose(1, 2, 0), strict=True):
        share = peak / figures[:, 0, 0]
        low, high = np.percentile(share, [5, 95])
        name = "none" if policy == "continue" else policy
        cells = [
            "{1:.{d}f} [{0:.{d}f}, {2:.{d}f}]".format(*np.percentile(values, [5, 50, 95]), d=digits)
            for values, digits in ((peak, 0), (contact_s, 2))
        ]
        print(f"| {name} | {cells[0]} | {share.mean():.2f} [{low:.2f}, {high:.2f}] | {cells[1]} |")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
