"""The arm in 3D, where it is touched, and the things about it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from tactful.dynamics import Dynamics
from tactful.live.view._meshes import link_poses, surfaces
from tactful.live.view._messages import Array, Frame, Setup
from tactful.live.view._words import COLOURS, kind_of, rgb
from tactful.monitor import ContactEvent

if TYPE_CHECKING:
    import viser

_LINK = ((240, 242, 244), (150, 163, 175))
_FORCE_M_PER_N = 0.008
_LONGEST_M, _UNIT_M = 0.40, 0.20
_SMALL_N = 1.5
_NOWHERE = np.array([[[0.0, 0.0, -9.0], [0.0, 0.0, -9.001]]])
_VELOCITY = (33, 102, 196)
_PLANNED, _TAUGHT = (120, 145, 170), rgb("cooperation")

CAMERA_M, LOOK_AT_M, CAMERA_FOV_RAD = (1.75, -1.15, 1.10), (0.3, 0.06, 0.36), 0.70

Grab = Callable[[str, int, Array, Array], None]
"""What is told of a drag: its phase, the link, the point that is held and where the mouse is."""


class Scene:
    """The scene of one run.

    Args:
        server: the page.
        setup: what is watched.
        on_drag: what to do when the arm is dragged.
        on_put: what to do when the obstacle is put somewhere (3,) [m].
    """

    def __init__(
        self, server: viser.ViserServer, setup: Setup, on_drag: Grab | None, on_put: Callable[[Array], None] | None
    ) -> None:
        self._scene = scene = server.scene
        self._robot = robot = setup.robot
        self._dynamics = Dynamics(robot) if robot is not None else None
        self._poses: list[tuple[Array, Array]] = []
        self._links: dict[int, viser.MeshHandle] = {}
        self._marked: int | None = None
        self._pinned: dict[int, Array] = {}
        self._tip = np.zeros(3)
        scene.add_grid(
            "/floor",
            width=3.0,
            height=3.0,
            cell_size=0.1,
            section_size=0.5,
            cell_color=(226, 231, 235),
            section_color=(200, 208, 214),
            shadow_opacity=0.18,
        )
        server.initial_camera.fov = CAMERA_FOV_RAD
        server.initial_camera.position = CAMERA_M
        server.initial_camera.look_at = LOOK_AT_M
        server.initial_camera.up = (0.0, 0.0, 1.0)
        if robot is not None:
            self._draw_arm(robot, setup, on_drag)
        self._draw_marks()
        self._obstacle: viser.BoxHandle | None = None
        if setup.obstacle_m is not None:
            self._draw_obstacle(setup, on_put)
        self.draw_way(setup.way_m, _PLANNED)

    def _draw_arm(self, robot, setup: Setup, on_drag: Grab | None) -> None:  # type: ignore[no-untyped-def]
        for link, surface in sorted(surfaces(robot, setup.model).items()):
            name = robot.link_names[link] if link >= 0 else "base"
            handle = self._scene.add_mesh_simple(
                f"/arm/{link + 1} {name}",
                surface.vertices.astype(np.float32),
                surface.faces.astype(np.uint32),
                color=_LINK[(link + 1) % 2],
            )
            self._links[link] = handle
            if on_drag is not None and link >= 0:
                handle.on_drag("left")(_drag(on_drag, link))

    def _draw_marks(self) -> None:
        scene = self._scene
        dark = COLOURS["free"]
        self._live = scene.add_arrows(
            "/force/now", _NOWHERE, (120, 134, 146), shaft_radius=0.006, head_radius=0.016, head_length=0.035
        )
        self._force = scene.add_arrows(
            "/force/contact", _NOWHERE, rgb("contact"), shaft_radius=0.010, head_radius=0.026, head_length=0.05
        )
        self._unit_force = scene.add_arrows(
            "/unit/force", _NOWHERE, rgb("contact"), shaft_radius=0.005, head_radius=0.014, head_length=0.03
        )
        self._unit_velocity = scene.add_arrows(
            "/unit/velocity", _NOWHERE, _VELOCITY, shaft_radius=0.005, head_radius=0.014, head_length=0.03
        )
        self._point = scene.add_icosphere("/contact", radius=0.03, color=rgb("contact"), opacity=0.85, visible=False)
        self._text = scene.add_label("/contact text", dark, visible=False, anchor="bottom-center")
        self._force_text = scene.add_label("/unit/force text", "force", visible=False, anchor="bottom-center")
        self._velocity_text = scene.add_label("/unit/velocity text", "velocity", visible=False, anchor="top-center")
        self._string = scene.add_line_segments("/hand/string", _NOWHERE, (18, 146, 90), thickness=0.008)
        self._palm = scene.add_icosphere("/hand/palm", radius=0.025, color=(18, 146, 90), visible=False)

    def _draw_obstacle(self, setup: Setup, on_put: Callable[[Array], None] | None) -> None:
        assert setup.obstacle_m is not None
        self._obstacle = box = self._scene.add_box(
            "/obstacle", color=(214, 140, 92), opacity=0.8, dimensions=setup.obstacle_size_m, position=setup.obstacle_m
        )
        if on_put is None:
            return
        begun: dict[str, Array] = {}

        @box.on_drag("left")
        async def drag(event: viser.SceneNodeDragEvent) -> None:
            camera = np.array(event.client.camera.position)
            if event.phase == "start":
                begun["grip"], begun["box"] = np.array(event.start_position), np.array(box.position)
            ray = np.array(event.end_position) - camera
            if "grip" in begun and abs(ray[2]) > 1e-6 and (s := (begun["grip"][2] - camera[2]) / ray[2]) > 0:
                moved = camera + s * ray - begun["grip"]
                target = begun["box"] + [moved[0], moved[1], 0.0]
                on_put(np.clip(target, [-0.8, -0.9, 0.0], [1.1, 0.9, 1.0]))

    def draw_way(self, way_m: Array | None, colour: tuple[int, int, int]) -> None:
        """Draw where the tip is to go (k, 3) [m]."""
        if way_m is not None:
            pieces = np.stack([way_m[:-1], way_m[1:]], axis=1)
            self._scene.add_line_segments("/way", pieces, colour, thickness=0.006)

    def place(self, q: Array | None) -> None:
        """Show the arm at q (n,) [rad]."""
        if self._robot is None or self._dynamics is None or q is None or not np.isfinite(q).all():
            return
        self._poses = link_poses(self._robot, q)
        self._tip = self._dynamics.pose(q)[1]
        for link, handle in self._links.items():
            if link >= 0:
                R, x = self._poses[link]
                handle.wxyz, handle.position = _quaternion(R), x

    def update(self, frame: Frame) -> None:
        """Show the things that move beside the arm."""
        force = frame.trace.force_n[-1] if len(frame.trace.t) else None
        if force is not None:
            self.feel(force)
        if self._obstacle is not None and frame.obstacle_m is not None:
            self._obstacle.position = frame.obstacle_m
        if frame.hand is not None:
            held, target = frame.hand
            self._string.points = np.array([[held, target]], dtype=np.float32)
            self._palm.position = target
        else:
            self._string.points = _NOWHERE.astype(np.float32)
        self._palm.visible = frame.hand is not None
        self.draw_way(frame.way_m, _TAUGHT)

    def feel(self, force_n: Array) -> None:
        """Show the force at the tip now (3,) [N]."""
        size = float(np.linalg.norm(force_n))
        self._live.points = self._arrow(self._tip, force_n if size > _SMALL_N else None)

    def pin(self, event: ContactEvent) -> None:
        """Take note of where on its link a contact is, as the arm stands now; there it is marked from then on."""
        link = self._link_of(event)
        self._pinned.pop(event.id, None)
        if link is not None and self._poses and event.location is not None and event.location.point_m is not None:
            R, x = self._poses[link]
            self._pinned[event.id] = R.T @ (np.array(event.location.point_m) - x)

    def mark(self, event: ContactEvent | None) -> None:
        """Show a contact: where, its force, and the unit vectors of force and velocity; None shows none."""
        colour = rgb(event.kind if event else "contact")
        link = self._link_of(event)
        if link != self._marked:
            if self._marked is not None:
                self._links[self._marked].color = _LINK[(self._marked + 1) % 2]
            self._marked = link
        visible = event is not None
        for handle in (self._point, self._text, self._force_text, self._velocity_text):
            handle.visible = visible
        if event is None:
            for arrow in (self._force, self._unit_force, self._unit_velocity):
                arrow.points = _NOWHERE.astype(np.float32)
            return
        if link is not None:
            self._links[link].color = _mixed(colour, _LINK[0])
        force = np.array(event.force_n)
        size = float(np.linalg.norm(force))
        point = self._where(event, link)
        self._point.position, self._point.color = point, colour
        self._force.points = self._arrow(point, self._force_at(event))
        self._text.text = f"{kind_of(event)}  {event.peak_force_n:.0f} N"
        self._text.position = point + np.array([0.0, 0.0, 0.09])
        self._unit(self._unit_force, self._force_text, force / size if size > 0 else None, colour)
        v = None if event.velocity_m_s is None else np.array(event.velocity_m_s)
        speed = 0.0 if v is None else float(np.linalg.norm(v))
        self._unit(
            self._unit_velocity, self._velocity_text, v / speed if v is not None and speed > 0.01 else None, None
        )
        for handle in (self._force, self._unit_force):
            handle.colors = np.array(colour, dtype=np.uint8)

    def _unit(self, arrow, text, vector: Array | None, colour: tuple[int, int, int] | None) -> None:  # type: ignore[no-untyped-def]
        text.visible = vector is not None
        if vector is None:
            arrow.points = _NOWHERE.astype(np.float32)
            return
        end = self._tip + _UNIT_M * vector
        arrow.points = np.array([[self._tip, end]], dtype=np.float32)
        text.position = end + 0.03 * vector

    def _arrow(self, point: Array, force_n: Array | None) -> Array:
        """Return an arrow that ends at the point, as a push does; nowhere without a force."""
        if force_n is None or not (size := float(np.linalg.norm(force_n))):
            return _NOWHERE.astype(np.float32)
        length = min(max(_FORCE_M_PER_N * size, 0.06), _LONGEST_M)
        return np.array([[point - length * force_n / size, point]], dtype=np.float32)

    def _force_at(self, event: ContactEvent) -> Array:
        where = event.location
        return np.array(event.force_n if where is None or event.link is None else where.force_n)

    def _link_of(self, event: ContactEvent | None) -> int | None:
        if event is None or self._robot is None or event.link not in self._robot.link_names:
            return None
        link = self._robot.link_names.index(event.link)
        return link if link in self._links else None

    def _where(self, event: ContactEvent, link: int | None) -> Array:
        if link is not None and self._poses and event.id in self._pinned:
            R, x = self._poses[link]
            return np.asarray(x + R @ self._pinned[event.id])
        return self._tip if link is None else self.middle_of(link)

    def middle_of(self, link: int) -> Array:
        """Return where the middle of a link is (3,) [m]; of the last one, the tip."""
        if self._robot is None or not self._poses or link == self._robot.n - 1:
            return self._tip
        R, x = self._poses[link]
        parts = [(c.p0_m + c.p1_m) / 2 for c in self._robot.capsules if c.link == link] or [np.zeros(3)]
        return np.asarray(x + R @ np.mean(parts, axis=0))


def _drag(on_drag: Grab, link: int):  # type: ignore[no-untyped-def]
    async def told(event) -> None:  # type: ignore[no-untyped-def]
        on_drag(event.phase, link, np.array(event.start_position), np.array(event.end_position))

    return told


def _mixed(a: tuple[int, int, int], b: tuple[int, int, int], share: float = 0.55) -> tuple[int, int, int]:
    red, green, blue = (round(share * x + (1 - share) * y) for x, y in zip(a, b, strict=True))
    return red, green, blue


def _quaternion(R: Array) -> Array:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(R).as_quat(scalar_first=True))
