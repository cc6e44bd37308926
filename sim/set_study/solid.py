"""Fig. 2 of the paper: a regulator's MOA set in the space of x, y and the velocity of x."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from controllers.admissible.moa import MoaSet, regulator_set
from controllers.baselines.paper import STRIDE
from controllers.geometry.support_polygon import support_polygon
from sim.record.palette import REGULATOR, SUPPORT, rgb
from sim.set_study.walk import Walk

Array = NDArray[np.float64]

_AXES = [0, 2, 1]  # x, y, xdot of the state [x, xdot, y, ydot]
_LIGHT = np.array([0.35, -0.75, 0.56])


def draw_solid(walk: Walk) -> tuple[Figure, list[dict[str, Any]]]:
    """Draw the set for the feet side by side and for one foot a stride ahead.

    Returns:
        The figure, and per set its rows, t_star and volume [m^3/s].
    """
    ahead = walk.feet["right"].moved(walk.feet["right"].position + np.array([STRIDE, 0.0]))
    staggered = [walk.feet["left"], ahead]
    middle = 0.5 * (staggered[0].position + staggered[1].position)
    panels = (
        ("Feet side by side: the axes do not couple, the set is a prism", walk.regulator),
        (
            f"Right foot {STRIDE:g} m ahead: a hexagon of support, the axes couple",
            regulator_set(walk.pendulum, walk.gain, support_polygon(staggered), middle),
        ),
    )
    figure = Figure(figsize=(14.0, 6.6), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    facts = []
    for column, (title, at) in enumerate(panels):
        axes = figure.add_axes((0.005 + 0.5 * column, 0.06, 0.46, 0.76), projection="3d")
        volume = _draw(axes, at)
        words = f"{title}\n{len(at.a)} rows, $t^*$ = {at.t_star}, volume {1e3 * volume:.2f}·10⁻³ m³/s"
        axes.set_title(words, fontsize=11.5, y=1.0)
        facts.append(
            {
                "figure": "2",
                "set": "regulator",
                "time": 0.0,
                "t_star": at.t_star,
                "plane": "x-y-xdot",
                "kind": "projection",
                "stance": "parallel" if column == 0 else "staggered",
                "volume": volume,
                "rows": len(at.a),
            }
        )
    figure.suptitle(
        "Fig. 2  MOA set of the COG regulator, projection onto the space of $x$, $y$, $\\dot x$",
        x=0.02, y=0.97, ha="left", fontsize=15, weight="bold",
    )  # fmt: skip
    setting = (
        f"{walk.robot.name}; {walk.gain.name}, dt {1e3 * walk.pendulum.dt:g} ms; from the COG at rest over the middle "
        "of the feet. Green: the support polygon, in which the ZMP stays from every state of the set."
    )
    figure.text(0.02, 0.895, setting, color="#505050")
    return figure, facts


def _draw(axes: Any, at: MoaSet) -> float:
    corners = at.polytope.vertices()[:, _AXES]
    hull = ConvexHull(corners)
    low, high = corners.min(axis=0), corners.max(axis=0)
    floor = low[2] - 0.35 * (high[2] - low[2])
    faces = _padded([_face(corners, hull, rows) for rows in _coplanar(hull.equations)])
    base = np.array(rgb(REGULATOR)) / 255.0
    size = high - low
    colours = []
    for face in faces:
        normal = np.cross((face[1] - face[0]) / size, (face[2] - face[0]) / size)
        bright = 0.62 + 0.38 * abs(float(normal @ _LIGHT)) / max(float(np.linalg.norm(normal)), 1e-12)
        colours.append((*np.clip(base * bright + 0.25 * bright, 0.0, 1.0), 0.72))
    solid = Poly3DCollection(faces, facecolors=colours, edgecolors="#12306e", linewidths=0.5)
    axes.add_collection3d(solid, autolim=False)
    support = at.polygon.vertices - at.centre
    shadow = np.column_stack([support, np.full(len(support), floor)])
    axes.add_collection3d(Poly3DCollection([shadow], facecolors=SUPPORT, alpha=0.3, edgecolors=SUPPORT), autolim=False)
    axes.plot([0, 0], [0, 0], [floor, high[2]], color="black", linewidth=0.8, linestyle=":")
    extent = np.maximum(np.abs(support).max(axis=0), np.abs(corners[:, :2]).max(axis=0)) * 1.05
    axes.set_xlim(-extent[0], extent[0])
    axes.set_ylim(-extent[1], extent[1])
    axes.set_zlim(floor, high[2])
    axes.set_box_aspect((1.25, 1.25, 1.0), zoom=0.92)
    axes.view_init(elev=22, azim=-58)
    axes.set_xlabel("$x - x_C$ [m]", labelpad=8)
    axes.set_ylabel("$y - y_C$ [m]", labelpad=8)
    axes.set_zlabel(r"$\dot x$ [m/s]", labelpad=6)
    axes.tick_params(labelsize=8)
    return float(hull.volume)


def _padded(faces: list[Array]) -> list[Array]:
    """Faces of one length by repeating their last corners: matplotlib pads ragged ones with unset memory."""
    longest = max(map(len, faces))
    return [np.vstack([face, *[face[-1:]] * (longest - len(face))]) for face in faces]


def _coplanar(equations: Array) -> list[NDArray[np.intp]]:
    """Groups of the simplices that lie in one plane."""
    _, which = np.unique(np.round(equations, 6), axis=0, return_inverse=True)
    return [np.flatnonzero(which.ravel() == group) for group in range(which.max() + 1)]


def _face(corners: Array, hull: ConvexHull, simplices: NDArray[np.intp]) -> Array:
    """Corners (p, 3) of a face, around it."""
    points = corners[np.unique(hull.simplices[simplices])]
    normal = hull.equations[simplices[0], :3]
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    about = points - points.mean(axis=0)
    angle = np.arctan2(about @ np.cross(normal, first), about @ first)
    return np.asarray(points[np.argsort(angle)])
