"""What a rig can tell before anything is inspected: its overlap, its scale, how exactly it will locate, and how well
pictures agree with its file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np

from relmodel.arrays import Bytes, Floats
from relmodel.errors import InputError
from relmodel.find.find import world_named
from relmodel.geometry.transforms import apply, inverse
from relmodel.store import Store
from vision.cameras.cameras import Prior, Rig, perturb
from vision.localisation.hypotheses import predict
from vision.localisation.measurements import COUNT, FOCAL, PLACE, correct_rig, describe_unknowns
from vision.localisation.verdict import compute_precision
from vision.planning import look_frame, usual_distance
from vision.scene import read_scene
from vision.stereo.agreement import Agreement, doubt_rig, find_shared_points, measure_agreement
from vision.stereo.epipolar import LATTICE, sees, view_lattice

RELIEF = 0.05  # of the distance, by which what is looked at is deep, either way
EDGE_PX = 0.3  # by which each of POINTS edges errs across its direction: so many arcs at some .1 px, together
POINTS = 64
DIAMETER_PX = 0.43  # by which the diameter of a bore errs: what the demonstration's inspections state in the median
BORE_MM = 10.0
LITTLE = 0.3  # share of a picture that the other camera sees, below which a pair matches little


@dataclass(frozen=True)
class RigCheck:
    """What a rig tells at a distance, mm.

    mm_per_px: by camera; pairs: of each two cameras the share of the first one's picture that the second sees, the
    angle of their axes and the baseline.  sigma_mm, sigma_deg, diameter_sigma_mm: expected standard deviations of a
    pose, along the worst directions, and of the diameter of a bore of BORE_MM, with the calibration as stated, or as is
    usual for the cameras that are unstated.  errors: how far (mm) an error of the file would move a pose, were it
    believed.  agreement, doubt: how two pictures agree with the file, and how they say that the rig is otherwise.
    undecidable: diameters with a tolerance that it is too rough for."""

    distance_mm: float
    mm_per_px: dict[str, float]
    pairs: dict[str, dict[str, float]]
    sigma_mm: float
    sigma_deg: float
    weakest: str
    diameter_sigma_mm: float
    errors: dict[str, float]
    unstated: list[str]
    agreement: Agreement | None = None
    doubt: str | None = None
    undecidable: list[str] = field(default_factory=list)

    def weigh_diameters(self, stated: Iterable[Any]) -> RigCheck:
        """The same with those of `stated`, rows of `object/diameters`, whose tolerance is no more than twice U."""
        edge = DIAMETER_PX * min(self.mm_per_px.values())
        scale = np.sqrt(max(self.diameter_sigma_mm**2 - edge**2, 0)) / BORE_MM
        return replace(
            self, undecidable=[r.size for r in stated if r.tolerance <= 4 * np.hypot(edge, r.nominal * scale)]
        )

    def sentences(self) -> list[str]:
        """The same in words."""
        scale = ", ".join(f"{name} {mm:.2f} mm a pixel" for name, mm in self.mm_per_px.items())
        said = [f"at {self.distance_mm:.0f} mm: {scale}"]
        said += [
            f"{names}: {describe_overlap(it['overlap'])}, {it['baseline_mm']:.0f} mm apart, axes "
            f"{it['vergence_deg']:.1f} degrees to each other"
            for names, it in self.pairs.items()
        ]
        said.append(
            f"a pose is told to {2 * self.sigma_mm:.2g} mm and {2 * self.sigma_deg:.2g} degrees (two sigma, worst: "
            f"{self.weakest}), the diameter of a bore of {BORE_MM:g} mm to {2 * self.diameter_sigma_mm:.2g} mm"
        )
        said += [
            f"{error} would move a pose by {mm:.2g} mm, were the file believed" for error, mm in self.errors.items()
        ]
        if self.unstated:
            said.append(f"the file does not say how well {', '.join(self.unstated)} were calibrated: state its sigma")
        if self.agreement is not None:
            said.append(
                f"of {self.agreement.points} points that both pictures show {self.agreement.near:.0%} lie within 2 px "
                f"of where the file has them, {self.agreement.distance_mm:.0f} mm off"
            )
        said += [f"U is too great for the tolerance of: {', '.join(self.undecidable)}"] * bool(self.undecidable)
        return said + ([self.doubt] if self.doubt else [])


def check_rig(
    rig: Rig, distance_mm: float, greys: Mapping[str, Bytes | Floats], points: Floats | None = None
) -> RigCheck:
    """What a rig tells of something at a distance, with edges through points (n, 3) in its frame, where they are known,
    and how two pictures agree with it: greys (rows, columns) by camera."""
    names = list(rig.cameras)
    points = _relief(rig, distance_mm) if points is None else points
    by_pose, by_camera = _differentiate(rig, points)
    unknowns = describe_unknowns(rig)
    free = unknowns.sigma.ravel() > 0
    jacobian = np.concatenate([by_pose, by_camera[:, free]], axis=1) / EDGE_PX
    information = jacobian.T @ jacobian
    information[6:, 6:] += np.diag(unknowns.precision[free])
    covariance = np.asarray(np.linalg.inv(information)[:6, :6])
    sigma_mm, sigma_rad, weakest = compute_precision(covariance, points.mean(axis=0))
    scale = {name: distance_mm / float(camera.matrix[0, 0]) for name, camera in rig.cameras.items()}
    focal = max(rig.sigma_of(name).focal for name in names)
    agreement = doubt = None
    if len(greys) > 1:
        two = rig.only(*list(greys)[:2])
        shared = find_shared_points(greys, two)
        agreement, doubt = measure_agreement(two, shared), doubt_rig(two, shared)
    return RigCheck(
        distance_mm,
        scale,
        compare_views(rig, distance_mm),
        sigma_mm,
        float(np.degrees(sigma_rad)),
        weakest,
        float(np.hypot(DIAMETER_PX * min(scale.values()), BORE_MM * focal)),
        _weigh_errors(rig, by_pose, by_camera, points.mean(axis=0)),
        [name for name in names if name not in rig.sigma],
        agreement,
        doubt,
    )


def compare_views(rig: Rig, distance_mm: float) -> dict[str, dict[str, float]]:
    """Of each two cameras of a rig, by both names, what `RigCheck.pairs` has."""
    pairs = {}
    for one, other in combinations(rig.cameras, 2):
        a, b = rig.rig_from_camera[one], rig.rig_from_camera[other]
        pairs[f"{one} and {other}"] = {
            "overlap": float(sees(rig, other, view_lattice(rig, one, distance_mm)).mean()),
            "baseline_mm": float(np.linalg.norm(b[:3, 3] - a[:3, 3])),
            "vergence_deg": float(np.degrees(np.arccos(np.clip(a[:3, 2] @ b[:3, 2], -1, 1)))),
        }
    return pairs


def describe_overlap(share: float) -> str:
    """The overlap of two views in words, and what to do where it is little."""
    little = ", too little for stereo: turn them toward each other" if share < LITTLE else ""
    return f"{share:.0%} of the one's picture lies in the other's{little}"


def find_edges_in_view(store: Store, rig: Rig, world: str | None, whence: Prior | tuple[str, float | None]) -> Floats:
    """Points (n, 3), rig's frame, of edges that its first camera sees of a world: from a prior; or of an object of it
    by name, from its broad side and a distance (mm), the usual one where that is None.

    Raises InputError where that shows nothing, or the world has no such object."""
    with store.read() as connection:
        world_id, name = world_named(store, connection, world)
        scene, paths = (stored := read_scene(store, connection, world_id)).scene, stored.paths
    if isinstance(whence, Prior):
        pose = whence.world_from_rig
    else:
        objects = np.array([path.split("/")[0] for path in paths])
        others = (objects != whence[0]) | ~scene.inspected
        if others.all():
            known = ", ".join(np.unique(objects[scene.inspected]))
            raise InputError(f"the world {name} has no inspected object {whence[0]}: it has {known}")
        scene = scene.without(others)
        pose = _face(scene.vertices[scene.triangles].reshape(-1, 3), rig, whence[1])
    seen = predict(scene, rig.only(next(iter(rig.cameras))), pose, POINTS).point
    if not len(seen):
        raise InputError(f"nothing of the world {name} is in view from there: correct the prior or the distance")
    return seen


def _face(points: Floats, rig: Rig, distance_mm: float | None) -> Floats:
    """The pose from which a rig looks at the middle of the broad side of what has these points (n, 3)."""
    low, high = points.min(axis=0), points.max(axis=0)
    right, _, thin = np.eye(3)[np.argsort(low - high)]
    far = distance_mm or usual_distance(rig, high - low)
    look = np.eye(4)
    look[:3] = np.stack([right, np.cross(-thin, right), -thin, (low + high) / 2 + far * thin], axis=1)
    return np.asarray(look @ inverse(look_frame(rig)))


def _relief(rig: Rig, distance_mm: float) -> Floats:
    """Points (n, 3), rig's frame, that the first camera sees about a distance, near and far by turns."""
    first = next(iter(rig.cameras))
    step = LATTICE // 8
    grid = np.arange(LATTICE * LATTICE).reshape(LATTICE, LATTICE)[step // 2 :: step, step // 2 :: step].ravel()
    eye = rig.rig_from_camera[first][:3, 3]
    depth = 1 + RELIEF * np.resize([-1.0, 1.0, 0.5], len(grid))
    return np.asarray(eye + (view_lattice(rig, first, distance_mm)[grid] - eye) * depth[:, None])


def _differentiate(rig: Rig, points: Floats) -> tuple[Floats, Floats]:
    """Derivatives of where edges through points (n, 3) are seen, across their directions, by the rig's pose (k, 6) and
    by its cameras' unknowns (k, 11 c)."""
    count = len(rig.cameras)
    seen = np.concatenate([sees(rig, name, points) for name in rig.cameras])
    angle = np.arange(len(points)) * 2.4  # the golden angle: edges of all directions
    normal = np.tile(np.stack([np.cos(angle), np.sin(angle)], axis=1), (count, 1))

    def across(values: Floats) -> Floats:
        moved = correct_rig(rig, values[6:].reshape(count, COUNT))
        from_rig = [inverse(perturb(np.eye(4), values[:6]) @ moved.rig_from_camera[name]) for name in rig.cameras]
        pixels = [
            camera.project(apply(pose, points))[0]
            for pose, camera in zip(from_rig, moved.cameras.values(), strict=True)
        ]
        return np.asarray((np.concatenate(pixels) * normal).sum(axis=1)[seen])

    steps = 1e-4 * np.eye(6 + count * COUNT)
    by = np.stack([(across(step) - across(-step)) / 2e-4 for step in steps], axis=1)
    return by[:, :6], by[:, 6:]


def _weigh_errors(rig: Rig, by_pose: Floats, by_camera: Floats, middle: Floats) -> dict[str, float]:
    """How far (mm) the middle of what is seen moves where a file is believed that errs in one way."""
    last = (len(rig.cameras) - 1) * COUNT
    name = list(rig.cameras)[-1]
    errors = {f"a focal length of {name} .1 % off": [(FOCAL, 1e-3)]}
    if len(rig.cameras) > 1:
        turn = np.radians(0.1)
        errors[f"{name} turned by .1 degrees"] = [(PLACE.start + 3 + axis, turn) for axis in range(3)]
        errors[f"{name} .1 mm from its place"] = [(PLACE.start + axis, 0.1) for axis in range(3)]
    moved = {}
    for words, each in errors.items():
        steps = [np.linalg.lstsq(by_pose, by_camera[:, last + which] * by, rcond=None)[0] for which, by in each]
        moved[words] = max(float(np.linalg.norm(step[:3] + np.cross(step[3:], middle))) for step in steps)
    return moved
