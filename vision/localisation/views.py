"""What the cameras of a rig saw together, and the arcs and surfaces of a model that they should see at a pose."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from relmodel.arrays import Bools, Bytes, Columns, Floats, Ints
from relmodel.store.database import round_columns
from vision.cameras.cameras import Camera, Rig
from vision.extraction.rows import Primitives
from vision.localisation.hypotheses import Prediction, project_with_jacobians
from vision.localisation.measurements import EdgeIndex
from vision.localisation.refine import RefinedPose
from vision.localisation.visibility import SurfaceMap, VisibleArcs, find_visible_arcs, map_surfaces
from vision.scene import Scene

BRIDGED_SAMPLES = 3  # shorter hidden stretches do not break a visible run of an arc, since rays graze
SHARP, SMOOTH, SILHOUETTE = range(3)
NO_RUN = -1
SPACING_PX = 4.0  # between the points of a view along an arc
KINDS = ("sharp", "smooth", "silhouette")


@dataclass(frozen=True)
class ViewArcs:
    """Runs of model arcs (n,) that a camera sees.  kind: index of KINDS; occurrence; element: the scene's arc, for a
    silhouette its surface; length px.  samples: the visible samples, run by run; run: the run of each."""

    kind: NDArray[np.int8]
    occurrence: Ints
    element: Ints
    length: Floats
    samples: VisibleArcs
    run: Ints


def find_view_arcs(scene: Scene, camera: Camera, world_from_camera: Floats) -> ViewArcs:
    """The runs of arcs that a camera sees; silhouettes of a surface are parted where they do not touch."""
    seen = find_visible_arcs(scene, camera, world_from_camera)
    arcs = len(scene.arc_occurrence)
    silhouette = seen.arc >= arcs
    gap = np.diff(seen.sample, prepend=-BRIDGED_SAMPLES - 2) > BRIDGED_SAMPLES + 1
    first = (np.diff(seen.arc, prepend=-1) != 0) | (gap & ~silhouette)
    run = np.cumsum(first) - 1
    strand, place = _strands(seen, np.flatnonzero(silhouette))
    _, run = np.unique(np.stack([run, strand], axis=1), axis=0, return_inverse=True)
    run = run.ravel()
    order = np.lexsort((place, run))
    seen, run = seen.take(order), run[order]
    head = np.flatnonzero(np.diff(run, prepend=-1) != 0)
    is_silhouette = seen.arc[head] >= arcs
    element = np.where(is_silhouette, seen.arc[head] - arcs, seen.arc[head])
    occurrence = scene.occurrence_of_arc[seen.arc[head]]
    share = np.bincount(run, seen.smooth) / np.maximum(np.bincount(run), 1)
    kind = np.where(is_silhouette, SILHOUETTE, np.where(share > 0.5, SMOOTH, SHARP)).astype(np.int8)
    return ViewArcs(kind, occurrence, element, np.bincount(run, seen.length_px).astype(float), seen, run)


def _strands(seen: VisibleArcs, rows: Ints) -> tuple[Ints, Ints]:
    """For each sample which connected strand of its surface's silhouette it lies on, and its place along it; zero for
    the others.  A silhouette comes triangle by triangle: its order is that of the shortest tree from an end of it."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components, depth_first_order, minimum_spanning_tree
    from scipy.spatial import cKDTree

    out, place = np.zeros((2, len(seen.arc)), np.int64)
    if len(rows):
        # A third coordinate beyond any picture's size keeps the surfaces apart.
        at = np.column_stack([seen.pixel[rows], 1e6 * seen.arc[rows]])
        reach = 2.0 * np.maximum(float(seen.length_px[rows].max()), 1.0)
        one, other = cKDTree(at).query_pairs(reach, output_type="ndarray").T
        far = np.linalg.norm(at[one] - at[other], axis=1) + 1e-6  # none is no edge
        tree = minimum_spanning_tree(coo_array((far, (one, other)), shape=(len(rows), len(rows))))
        out[rows] = connected_components(tree, directed=False)[1]
        at_end = np.bincount(np.concatenate(tree.nonzero()), minlength=len(rows)) <= 1
        first = np.unique(2 * out[rows] + ~at_end, return_index=True)[1]  # of each strand an end, and another
        starts = first[np.diff(out[rows][first], prepend=-1) != 0]
        walks = [depth_first_order(tree, k, directed=False, return_predecessors=False) for k in starts.tolist()]
        place[rows[np.concatenate(walks)]] = np.arange(len(rows))
    return out, place


def propagate_pose(refined: RefinedPose, camera: int, samples: VisibleArcs) -> Floats:
    """How far (n, 6) px a standard deviation of the pose along each axis of its covariance moves a camera's samples
    along their normals; the norm of a row is the standard deviation that the pose makes there."""
    p, rig_from_world = refined.prediction, np.linalg.inv(refined.world_from_rig)
    n = len(samples.arc)
    there = replace(
        p,
        point=samples.point @ rig_from_world[:3, :3].T + rig_from_world[:3, 3],
        tangent=samples.tangent,
        weight=np.ones(n),
        view=np.full(n, camera),
        arc=samples.arc,
    )
    _, jacobian = project_with_jacobians(there)
    normal = np.stack([-samples.direction[:, 1], samples.direction[:, 0]], axis=1)
    along = np.einsum("ni,nij->nj", normal, jacobian)
    size, axes = np.linalg.eigh(refined.covariance)
    return np.asarray(along @ (axes * np.sqrt(np.maximum(size, 0.0))))


@dataclass(frozen=True)
class EdgeMeasurements:
    """The edge elements that a camera measured the pose with, as columns.

    view_arc: the run, -1 where none of the view's is of the arc; world (n, 3) mm: the model point; normal (n, 2);
    position (n, 2): the element found, pixels of the camera without distortion; sigma px; weight 0..1; residual px
    along the normal where the pictures were last looked at, the camera's own unknowns taken off.  response: derivative
    of the place by the camera's response; arc_shift px: standard deviation of how far the arc's image is shifted as a
    whole; arc: which."""

    view_arc: Ints
    world: Floats
    normal: Floats
    position: Floats
    sigma: Floats
    weight: Floats
    residual: Floats
    response: Floats
    arc_shift: Floats
    arc: Ints


def collect_edge_measurements(refined: RefinedPose, camera: int, view: ViewArcs, index: EdgeIndex) -> EdgeMeasurements:
    """What a refinement measured at last in one camera (by number), by the runs of its view."""
    p, m = refined.prediction, refined.measurements
    rows = np.flatnonzero((p.view == camera) & (m.found >= 0))
    direction = m.direction[rows]
    pose = refined.last_step.world_from_rig if refined.last_step else refined.world_from_rig
    return EdgeMeasurements(
        view_arc=_nearest_run(p, m.pixel, rows, view),
        world=p.point[rows] @ pose[:3, :3].T + pose[:3, 3],
        normal=np.stack([-direction[:, 1], direction[:, 0]], axis=1),
        position=index.edges.position[m.found[rows]],
        sigma=m.sigma[rows],
        weight=m.weight[rows],
        residual=m.offset[rows],
        response=m.response[rows],
        arc_shift=m.arc_shift[rows],
        arc=p.arc[rows],
    )


def _nearest_run(p: Prediction, pixel: Floats, rows: Ints, view: ViewArcs) -> Ints:
    from scipy.spatial import cKDTree

    if not len(rows) or not len(view.run):
        return np.full(len(rows), NO_RUN)
    # The nearest sample of the same arc: a third coordinate beyond any picture's size keeps the arcs apart.
    tree = cKDTree(np.column_stack([view.samples.pixel, 1e6 * view.samples.arc]))
    nearest = tree.query(np.column_stack([pixel[rows], 1e6 * p.arc[rows]]))[1]
    return np.where(view.samples.arc[nearest] == p.arc[rows], view.run[nearest], NO_RUN)


@dataclass(frozen=True)
class Observation:
    """What the cameras of a rig saw together, by camera: what was extracted from their pictures, and the greys (rows,
    columns) of these.

    partnered: of the cameras of a stereo pair, which image arcs (n,) have a partner in the other's picture."""

    rig: Rig
    pictures: Mapping[str, Primitives]
    greys: Mapping[str, Bytes | Floats]
    partnered: Mapping[str, Bools] = field(default_factory=dict)

    def only(self, names: Iterable[str]) -> Observation:
        """What some of the cameras saw."""
        rig = self.rig.only(*names)
        pictures = {name: self.pictures[name] for name in rig.cameras}
        return Observation(rig, pictures, {name: self.greys[name] for name in rig.cameras})


@dataclass(frozen=True)
class ModelView:
    """What the cameras of a rig should see of a model at a pose, by camera: its arcs, and which of its surfaces each
    place of the picture shows."""

    arcs: Mapping[str, ViewArcs]
    maps: Mapping[str, SurfaceMap]


def view_model(scene: Scene, rig: Rig, world_from_rig: Floats, arcs: Mapping[str, ViewArcs] | None = None) -> ModelView:
    """What a rig's cameras should see of a scene at a pose; arcs: those in view, where they are known."""
    placed = {name: (camera, world_from_rig @ rig.rig_from_camera[name]) for name, camera in rig.cameras.items()}
    if arcs is None:
        arcs = {name: find_view_arcs(scene, *it) for name, it in placed.items()}
    return ModelView(arcs, {name: map_surfaces(scene, *it) for name, it in placed.items()})


@dataclass(frozen=True)
class ViewPoints:
    """Where a picture should show the arcs of a view: columns of view_point without run and view; shift (points, 6): px
    by which a standard deviation of the pose along each axis of its covariance moves each along its normal."""

    rows: Columns
    shift: Floats


def place_points(view: ViewArcs, shift: Floats, camera: Camera) -> ViewPoints:
    """Points every few px along the arcs of a view, and both ends of each; shift (samples, 6): of its samples."""
    step = np.floor(np.cumsum(view.samples.length_px) / SPACING_PX)
    ends = (np.diff(view.run, prepend=-1) != 0) | (np.diff(view.run, append=-1) != 0)
    some = np.flatnonzero((np.diff(step, prepend=-1) > 0) | ends)
    ideal, direction = view.samples.pixel[some], view.samples.direction[some]
    pixel = camera.distort(camera.normalise(ideal))
    ahead = camera.distort(camera.normalise(ideal + 0.5 * direction))
    back = camera.distort(camera.normalise(ideal - 0.5 * direction))
    way = ahead - back
    way /= np.maximum(np.linalg.norm(way, axis=1), 1e-12)[:, None]
    columns = {
        "view_arc_no": view.run[some],
        "point_no": np.arange(len(some)),
        "x": pixel[:, 0],
        "y": pixel[:, 1],
        "direction_x": way[:, 0],
        "direction_y": way[:, 1],
        "sigma": np.linalg.norm(shift[some], axis=1),
    }
    return ViewPoints(round_columns("view_point", columns), shift[some])


def place_views(rig: Rig, pose: RefinedPose, view: ModelView) -> dict[str, ViewPoints]:
    """Where the pictures should show the arcs of their views at a pose, by camera."""
    return {
        name: place_points(view.arcs[name], propagate_pose(pose, number, view.arcs[name].samples), camera)
        for number, (name, camera) in enumerate(rig.cameras.items())
    }
