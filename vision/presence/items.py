"""What is assessed, parts, features and surfaces in view, what they look like, and what no edge accounts for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np

from relmodel.arrays import Bools, Bytes, Floats, Ints, Rows, sum_by_group
from relmodel.geometry.congruence import greatest
from vision.account.samples import Samples
from vision.cameras.cameras import Camera, Rig
from vision.extraction.arcs import LINE
from vision.extraction.rows import Primitives
from vision.localisation.measurements import EdgeIndex
from vision.localisation.views import ViewArcs
from vision.localisation.visibility import PART, PartsInView, SurfaceMap, VisibleArcs, trace_surfaces
from vision.presence.presence_parameters import AppearanceParameters, UnexplainedParameters
from vision.scene import Scene, StoredScene

INSETS = ("through_hole", "blind_hole", "boss", "duct")
NONE = -1  # number of the feature or surface of an item that is neither


@dataclass(frozen=True)
class Items:
    """Parts and features, as `PartsInView` has them, then surfaces, as columns.

    level: part, feature or surface; occurrence: the scene's; feature_no, surface_no: in the part's shape, NONE where
    the item is neither; path; kind: of a feature, else empty; visible_px: by all cameras; thickness: mm, nan where it
    has none. member, surface: pairs of item and the scene's surface that belongs to it, sorted by item.  inset (s,):
    which of the scene's surfaces make a hole, a boss or a duct: its edges are not those of what it is cut into."""

    level: list[str]
    occurrence: Ints
    feature_no: Ints
    surface_no: Ints
    path: list[str]
    kind: list[str]
    visible_px: Floats
    thickness: Floats
    member: Ints
    surface: Ints
    inset: Bools

    def __len__(self) -> int:
        return len(self.path)


def list_items(stored: StoredScene, parts: PartsInView, seen: Sequence[SurfaceMap]) -> Items:
    """All that is in view of inspected objects; seen: by camera."""
    scene, rows = stored.scene, stored.features
    occurrence = np.searchsorted(stored.occurrence_id, parts.occurrence_id)
    kept = np.flatnonzero(scene.inspected[occurrence])
    occurrence, feature_no = occurrence[kept], parts.feature_no[kept]
    visible = np.zeros(len(stored.surface_no))
    for shown in seen:
        visible += shown.count_pixels(len(visible))
    faces = np.flatnonzero((visible > 0) & scene.inspected[scene.surface_occurrence])

    # Surfaces of a feature stand together; those of a part are of its occurrence.
    shape, number = (np.asarray(rows[name], np.int64) for name in ("shape_id", "feature_no"))
    first = np.flatnonzero((np.diff(shape, prepend=-1) != 0) | (np.diff(number, prepend=-1) != 0))
    those = {(shape[a], number[a]): slice(a, b) for a, b in pairwise([*first.tolist(), len(shape)])}
    faces_of = zip(scene.surface_occurrence.tolist(), stored.surface_no.tolist(), strict=True)
    by_number = {name: surface for surface, name in enumerate(faces_of)}
    of_inset = np.isin(np.asarray(rows["kind"], str), INSETS)
    insets = set(zip(shape[of_inset].tolist(), np.asarray(rows["surface_no"])[of_inset].tolist(), strict=True))
    names = zip(stored.shape_id[scene.surface_occurrence].tolist(), stored.surface_no.tolist(), strict=True)
    kind, thickness, surfaces = [""] * len(kept), np.full(len(kept), np.nan), []
    for row, (o, f) in enumerate(zip(occurrence.tolist(), feature_no.tolist(), strict=True)):
        if f == PART:
            surfaces.append(np.flatnonzero(scene.surface_occurrence == o))
            continue
        mine = those[int(stored.shape_id[o]), f]
        surfaces.append(np.array([by_number[o, int(n)] for n in rows["surface_no"][mine]], np.int64))
        kind[row] = str(rows["kind"][mine][0])
        value = rows["thickness"][mine][0]
        thickness[row] = np.nan if value is None else float(value)
    named = zip(scene.surface_occurrence[faces].tolist(), stored.surface_no[faces].tolist(), strict=True)
    none = np.full(len(faces), NONE)
    return Items(
        level=["part" if f == PART else "feature" for f in feature_no] + ["surface"] * len(faces),
        occurrence=np.concatenate([occurrence, scene.surface_occurrence[faces]]),
        feature_no=np.concatenate([np.where(feature_no == PART, NONE, feature_no), none]),
        surface_no=np.concatenate([np.full(len(kept), NONE), stored.surface_no[faces]]),
        path=[parts.path[k] for k in kept] + [f"{stored.paths[o]}/face {n}" for o, n in named],
        kind=kind + [""] * len(faces),
        visible_px=np.concatenate([parts.visible[kept], visible[faces]]),
        thickness=np.concatenate([thickness, np.full(len(faces), np.nan)]),
        member=np.concatenate(
            [np.repeat(np.arange(len(kept)), [len(s) for s in surfaces]), len(kept) + np.arange(len(faces))]
        ),
        surface=np.concatenate([*surfaces, faces]),
        inset=np.array([name in insets for name in names], bool),
    )


# What features and surfaces look like: the grey and the texture of what is seen of them, held against what would be
# seen there with them and without.
#
# With it, faces look as faces turned likewise do elsewhere in the same picture, and through a hole shows what lies
# behind the object elsewhere. Without it, what is around continues, or what lies behind shows, or something else
# altogether is there. Both are mixtures of Gaussians over what the picture shows. Grey that is as bright as can be is a
# value as any other: a dark hole in glare is told by the glare around it.

THROUGH = ("through_hole", "duct")
BORES = (*THROUGH, "blind_hole", "boss")
SET_APART = (*BORES, "pocket")  # in another light than what they are cut into or stand on
WITHIN = (*SET_APART, "open_slot", "rib", "step")  # of what is around: without them that continues
_NONE = -1
_ANYTHING = 1 / (255 * 3.0)  # density of any grey with any texture
FARTHEST = 4  # cells from a patch to what lies beside it
MARGIN, ACROSS = 3, (0, 12, 40)  # cells around small patches that are looked at closer, and across such of like size


@dataclass(frozen=True)
class Appearance:
    """Features and surfaces that a camera sees enough of, as columns: item; camera: number in the rig; pixels: seen of
    it; grey, around, like: mean grey, 0..255, of it, of what is around it, and of what it would look like; log_odds: of
    there against not there, by that; stopped: whether all cameras together see something in it, not behind it."""

    item: Ints
    camera: Ints
    pixels: Floats
    grey: Floats
    around: Floats
    like: Floats
    log_odds: Floats
    stopped: Bools


def look_at_features(
    items: Items,
    samples: Samples,
    scene: Scene,
    greys: Sequence[Bytes | Floats],
    seen: Sequence[SurfaceMap],
    p: AppearanceParameters,
) -> Appearance:
    """The appearance of all features and surfaces; samples: the rims of holes among others; greys (rows, columns),
    seen: by camera, in the rig's order."""
    pieces, normal = [], find_normals(scene)
    for camera, (grey, shown) in enumerate(zip(greys, seen, strict=True)):
        patches = _find_patches(items, samples.take(samples.camera == camera), grey, shown, scene, normal, p)
        pieces.append((np.full(len(patches[0]), camera), *patches))
    camera_no, item, pixels, mean, around, like, odds, through = (np.concatenate(c) for c in zip(*pieces, strict=True))
    count = len(items)
    total = np.bincount(item, np.where(np.isfinite(through), through, 0.0), count)
    # Each camera that looks through must see another thing.
    worst = greatest(np.where(np.isfinite(through), through, -np.inf), item, count, -np.inf)
    stopped = (total <= -p.stopped_log_odds) & np.isfinite(worst) & (worst < -p.camera_log_odds)
    order = np.lexsort((camera_no, item))
    columns = (item, camera_no, pixels, mean, around, like, odds, stopped[item])
    return Appearance(*(np.asarray(column)[order] for column in columns))


def find_normals(scene: Scene) -> Floats:
    """The way (s, 3) that each surface looks, by the areas of its triangles; unit vectors, zero where it closes."""
    corner = scene.vertices[scene.triangles]
    way = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    total = sum_by_group(scene.triangle_surface, way, len(scene.surface_occurrence))
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-9))


_Columns = tuple[Ints, Floats, Floats, Floats, Floats, Floats, Floats]  # of Appearance; last the log odds through it


def _find_patches(
    items: Items, samples: Samples, grey: Bytes | Floats, shown: SurfaceMap, scene: Scene,
    normal: Floats, p: AppearanceParameters,
) -> _Columns:  # fmt: skip
    """One camera's columns."""
    empty = ((shown.surface < 0) & (shown.rays.weight > 0)).astype(np.uint8)
    count, labels = cv2.connectedComponents(empty, connectivity=4, ltype=cv2.CV_32S)
    place = np.asarray(labels, np.int64)
    surfaces = len(normal)
    # A patch is what is seen of a surface, or a place where the model shows nothing.
    whole = np.where(shown.surface >= 0, shown.surface, np.where(empty > 0, surfaces + place, _NONE))
    kept = np.unique(whole[whole != _NONE])
    number = np.full(surfaces + count + 1, _NONE)
    number[kept] = np.arange(len(kept))
    hole = _find_holes(items, samples, shown, place, count, p)
    of_patch, is_empty = np.concatenate([normal, np.zeros((count, 3))])[kept], kept >= surfaces
    patch, texture = number[whole], _measure_texture(grey)
    look = _measure_patches(patch, len(kept), _sample(texture, shown.rays.pixel), shown.rays.step)
    bores = number[np.unique(items.surface[np.isin(items.kind, BORES)[items.member]])]
    small = bores[(bores != _NONE) & (np.append(look.cells, 0.0)[bores] < p.sure_cells)]
    for across in pairwise(ACROSS):
        own = small, across, number[:surfaces], is_empty
        look = _look_closer(look, patch, *own, shown, scene, texture, p.sure_cells)

    own = (np.array(items.level) != "part")[items.member]
    item = np.concatenate([items.member[own], hole[hole != _NONE]])
    part = number[np.concatenate([items.surface[own], surfaces + np.flatnonzero(hole != _NONE)])]
    seen = (part != _NONE) & (np.append(look.cells, 0.0)[part] >= p.least_cells)
    item, part = item[seen], part[seen]
    if not len(item):
        return item, *np.zeros((6, 0))
    belongs = np.zeros((len(items), len(of_patch)), bool)
    belongs[item, part] = True

    # Without it what neighbours its patches continues, if it is cut into that or raised on it; else, or besides, what
    # lies behind the object shows.
    rows = np.unique(item)
    kind = np.array(items.kind)[rows, None]
    around, near = look.around(belongs[rows])
    continues = np.where(np.isin(kind, WITHIN), around, 0.0)
    behind = np.where(is_empty & (look.cells >= p.least_cells), np.minimum(look.cells, p.most_cells_behind), 0.0)
    shows = np.where(np.isin(kind, SET_APART) | belongs[rows], 0.0, behind)
    without_it = np.where(continues > 0, continues, shows)
    at = np.searchsorted(rows, item)
    known = (without_it[at].sum(axis=1) >= p.least_cells) & (around[at].sum(axis=1) > 0)
    item, part, at = item[known], part[known], at[known]
    mean = look.mean[part]
    spread = np.broadcast_to(np.array([p.grey, p.texture]), look.mean.shape)
    expected = np.where((continues > 0)[..., None], near, look.mean)
    without = _log_density(mean, expected[at], spread, without_it[at], p.else_there)

    # As the feature: what is turned alike and near, and belongs to none of its features.
    alike = ((of_patch[part][:, None] - of_patch[None]) ** 2).sum(axis=2)
    far = ((look.centre[part][:, None] - look.centre[None]) ** 2).sum(axis=2)
    weight_like = np.exp(-0.5 * alike / p.alike**2) / (1 + far / p.near_cells**2)
    weight_like *= np.minimum(look.cells, p.most_cells) * (look.cells >= p.least_cells)
    weight_like *= is_empty[part][:, None] == is_empty
    weight_like[belongs[item]] = 0.0
    # Light that makes all around a hole as bright as can be may fill it too, unless others in such light are dark.
    rim, look_of_rim = look.around(np.eye(len(kept), dtype=bool) & is_empty)
    lit = (rim * look_of_rim[..., 0]).sum(axis=1) > np.maximum(p.lit * rim.sum(axis=1), p.lit)
    weight_like *= lit[part][:, None] <= lit
    total = weight_like.sum(axis=1)
    # Where little is like it, it may look like anything.
    usual = np.where(is_empty[part], p.usual_cells_behind, p.usual_cells)
    unlike = p.unlike + (1 - p.unlike) * usual / (usual + total)
    spread = np.hypot(look.spread, [1.5 * p.grey, p.texture])
    with_it = _log_density(mean, np.broadcast_to(look.mean, (len(part), *look.mean.shape)), spread, weight_like, unlike)

    # What lies close behind may lie in the object's shadow: darker and smoother.
    like = np.einsum("nq,qk->nk", weight_like, look.mean) / np.maximum(total, 1e-9)[:, None]
    range_of = np.maximum(like * [1 - p.least_bright, 1.0], [p.grey, p.texture]).prod(axis=1)
    shade = np.logaddexp(np.log1p(-p.shaded) + with_it, np.log(p.shaded / range_of))
    darker = (mean[:, 0] < like[:, 0]) & (mean[:, 0] > p.least_bright * like[:, 0])
    with_it = np.where(is_empty[part] & darker, shade, with_it)

    filled = np.where(lit[part], p.usual_cells / (p.usual_cells + total + 1e-6), 1e-300)
    with_it = np.logaddexp(np.log1p(-filled) + with_it, np.log(filled) + without)

    odds = np.clip(with_it - without, -p.most_log_odds, p.most_log_odds)
    # What is cut or raised without depth lies in one light with what is around it, and may look so though it is there.
    kind = np.array(items.kind)[item]
    level = np.isin(kind, WITHIN) & ~np.isin(kind, SET_APART)
    odds[level] = np.logaddexp(np.log1p(-p.like_around) + odds[level], np.log(p.like_around))
    beside = (around[at] * near[at][..., 0]).sum(axis=1) / around[at].sum(axis=1)
    counted = np.minimum(look.cells[part], p.most_cells_of_patch)

    def add_up(values: Floats) -> Floats:
        return np.bincount(item, values, len(items)).astype(float)

    through = np.full(len(items), np.nan)
    looks_through = is_empty[part] & (total > p.least_cells)
    sure = np.minimum(look.cells[part] / p.sure_cells, 1.0)
    through[item[looks_through]] = (odds * sure)[looks_through]
    rows = np.unique(item)
    cells, pixels = add_up(counted)[rows], add_up(look.pixels[part])[rows]
    means = [add_up(counted * values)[rows] / cells for values in (mean[:, 0], beside, like[:, 0], odds)]
    means[3] *= np.where(np.isin(np.array(items.kind)[rows], WITHIN), p.share, p.share_of_faces)
    means[3] *= np.minimum(cells / p.sure_cells, 1.0)
    return rows, pixels, *means, through[rows]


@dataclass(frozen=True)
class _Patches:
    """Of patches (q,): cells (q,) that lie clear of their borders, pixels (q,) of these; mean, spread (q, 2): of grey
    and texture; centre (q, 2): cell; and which lie side by side, as columns: one, other; cells; values (n, 2): mean of
    the other there."""

    cells: Floats
    pixels: Floats
    mean: Floats
    spread: Floats
    centre: Floats
    one: Ints
    other: Ints
    beside: Floats
    values: Floats

    def around(self, belongs: Bools) -> tuple[Floats, Floats]:
        """For groups of patches (g, q) the cells (g, q) of each patch beside that belongs to none of theirs, and the
        mean (g, q, 2) of it there."""
        weight = np.zeros(belongs.shape)
        total = np.zeros((*belongs.shape, 2))
        group, row = np.nonzero(belongs[:, self.one] & ~belongs[:, self.other])
        np.add.at(weight, (group, self.other[row]), self.beside[row])
        np.add.at(total, (group, self.other[row]), self.beside[row, None] * self.values[row])
        return weight, total / np.maximum(weight, 1e-9)[..., None]


def _look_closer(
    look: _Patches, patch: Ints, small: Ints, across: tuple[int, int], of_surface: Ints, is_empty: Bools,
    shown: SurfaceMap, scene: Scene, texture: Floats, most_cells: float,
) -> _Patches:  # fmt: skip
    """Patches, of which small ones (k,), so many cells across, and what lies beside them are measured by pixels in
    windows.  patch (rows, columns): of each cell; of_surface (s,): of each surface; is_empty (q,): showing nothing."""
    from scipy.ndimage import find_objects

    step, boxes = shown.rays.step, find_objects(patch + 1)
    box = np.array([[(y.start, x.start), (y.stop, x.stop)] for y, x in (boxes[k] for k in small.tolist())], int)
    size = np.diff(box.reshape(-1, 2, 2), axis=1).max(axis=(1, 2))
    small, box = (it[(size > across[0]) & (size <= across[1])] for it in (small, box))
    if not len(small):
        return look
    low, high = step * np.maximum(box[:, 0] - MARGIN, 0), step * np.minimum(box[:, 1] + MARGIN, patch.shape)
    pixel = low[:, None, None] + np.moveaxis(np.indices((high - low).max(axis=0) + FARTHEST), 0, 2)
    inside = (pixel < high[:, None, None]).all(axis=3)
    y, x = pixel[inside].T
    way = np.stack([x, y, np.ones(len(x))], axis=1) @ np.linalg.inv(shown.camera.undistorted_view()[2]).T
    surface, nearby = trace_surfaces(scene, shown.world_from_camera, way), patch[y // step, x // step]
    of, values = np.full(inside.shape, _NONE), np.zeros((*inside.shape, 2))
    of[inside] = np.where(surface >= 0, of_surface[surface], np.where(is_empty[nearby], nearby, _NONE))
    values[inside] = _sample(texture, shown.camera.project(way)[0])
    columns, rest = inside.shape[2], ~np.isin(np.arange(len(is_empty)), small)
    out = _measure_patches(of.reshape(-1, columns), len(is_empty), values.reshape(-1, columns, 2), 1)
    out.centre[small] = box.mean(axis=1)
    np.minimum(out.cells, most_cells, out=out.cells)
    for name in ("cells", "pixels", "mean", "spread", "centre"):
        getattr(out, name)[rest] = getattr(look, name)[rest]
    beside = {name: (getattr(look, name), getattr(out, name)) for name in ("one", "other", "beside", "values")}
    kept, own = rest[look.one], ~rest[out.one]
    return replace(out, **{name: np.concatenate([a[kept], b[own]]) for name, (a, b) in beside.items()})


def _measure_texture(grey: Bytes | Floats) -> Floats:
    """Grey and texture (rows, columns, 2) of a picture: the mean of 3 px, and log1p of the deviation within 7."""
    single = grey.astype(np.float32)
    smooth, wide = cv2.blur(single, (3, 3)), cv2.blur(single, (7, 7))
    texture = np.log1p(np.sqrt(np.maximum(cv2.blur(single * single, (7, 7)) - wide * wide, 0.0)))
    return np.stack([smooth, texture], axis=2)


def _sample(texture: Floats, pixel: Floats) -> Floats:
    """Values (..., 2) at the pixels (..., 2) of a picture."""
    x, y = np.moveaxis(np.rint(pixel).astype(np.int64), -1, 0)
    x, y = np.clip(x, 0, texture.shape[1] - 1), np.clip(y, 0, texture.shape[0] - 1)
    return np.asarray(texture[y, x], float)


def _measure_patches(patch: Ints, count: int, values: Floats, step: int) -> _Patches:
    """Patches (rows, columns) of cells `step` px wide with these values (rows, columns, 2)."""
    kernel = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], np.uint8)
    number = patch.astype(np.float32)
    clear = (cv2.dilate(number, kernel) == number) & (cv2.erode(number, kernel) == number) & (patch >= 0)
    of, there = patch[clear], values[clear]
    cells = np.bincount(of, minlength=count).astype(float)

    def average(columns: Floats) -> Floats:
        sums = np.stack([np.bincount(of, column, count) for column in columns.T], axis=1)
        return np.asarray(sums / np.maximum(cells, 1)[:, None])

    mean = average(there)
    spread = np.sqrt(np.maximum(average(there**2) - mean**2, 0.0))
    centre = average(np.argwhere(clear).astype(float))
    keys, sides = [], []
    rows, columns = patch.shape
    for far in (2, FARTHEST):
        for down, right in ((0, far), (far, 0), (far, far), (far, -far)):
            a = (slice(0, rows - down), slice(max(-right, 0), columns - max(right, 0)))
            b = (slice(down, rows), slice(max(right, 0), columns - max(-right, 0)))
            for one, other in ((a, b), (b, a)):
                apart = clear[other] & (patch[one] >= 0) & (patch[one] != patch[other])
                keys.append(patch[one][apart] * count + patch[other][apart])
                sides.append(values[other][apart])
    key, which = np.unique(np.concatenate(keys), return_inverse=True)
    beside = np.bincount(which.ravel(), minlength=len(key)).astype(float)
    there = np.concatenate(sides)
    sums = np.stack([np.bincount(which.ravel(), column, len(key)) for column in there.T], axis=1)
    sides_of = key // count, key % count, beside, sums / beside[:, None]
    return _Patches(cells, cells * step**2, mean, spread, centre, *sides_of)


def _log_density(at: Floats, mean: Floats, spread: Floats, weight: Floats, anything: Floats | float) -> Floats:
    """Log density (n,) at points (n, 2) of mixtures of Gaussians (n, q), means (n, q, 2), deviations (q, 2), weights
    (n, q), and of anything in a share."""
    density = np.exp(-0.5 * (((at[:, None] - mean) / spread) ** 2).sum(axis=2)) / (2 * np.pi * spread.prod(axis=1))
    mixed = (weight * density).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-9)
    return np.asarray(np.log((1 - anything) * mixed + anything * _ANYTHING))


def _find_holes(
    items: Items, samples: Samples, shown: SurfaceMap, place: Ints, count: int, p: AppearanceParameters
) -> Ints:
    """The item (places,) that each place is seen through, by the edges around it; -1 of none, as outside the object."""
    bore = np.isin(np.array(items.kind), THROUGH)[items.member]
    order = np.argsort(items.surface[bore], kind="stable")
    surface, member = items.surface[bore][order], items.member[bore][order]
    near = cv2.dilate(place.astype(np.float32), np.ones((3, 3))).astype(np.int64)  # a rim lies around it
    out = np.full(count, _NONE)
    if not len(surface) or not len(samples.run):
        return out
    nearby = shown.value_along(near, shown.camera.normalise(samples.pixel), 0)
    votes = np.zeros((len(items), count))
    for side in (0, 1):
        at = np.minimum(np.searchsorted(surface, samples.surface[:, side]), len(surface) - 1)
        own = (surface[at] == samples.surface[:, side]) & (nearby > 0)
        np.add.at(votes, (member[at[own]], nearby[own]), samples.length_px[own])
    best = votes.argmax(axis=0)
    around = np.bincount(nearby, samples.length_px, count)
    clear = votes[best, np.arange(count)] >= p.least_rimmed * np.maximum(around, 1e-9)
    out[clear] = best[clear]
    return out


# Arcs and regions of a picture that may be an object and that no predicted edge accounts for.
#
# A region is unexplained where most of its border runs along such arcs: a bolt, a plug, a patch or a part that the
# model does not have. Its border is then an edge of clear contrast and no edge of the model, so it is of another
# brightness than the surface that it lies on. Texture, highlights and shading have no such arcs around them, and
# shadows of the structure begin at predicted edges.

KINDS = ("closed", "curved", "straight", "region")
CLOSED, CURVED, STRAIGHT, REGION = range(4)


@dataclass(frozen=True)
class UnexplainedElements(Rows):
    """Arcs and regions of the pictures, the most telling first, as columns: camera: number in the rig; kind: index of
    KINDS; arc, region: in its picture, NONE of the other; box (n, 4): least x, y, greatest x, y, px of the picture;
    length px, of a region of the border that is unexplained; contrast grey, mean along it; beyond: whether most of it
    lies where the model shows nothing at all."""

    camera: Ints
    kind: Ints
    arc: Ints
    region: Ints
    box: Floats
    length: Floats
    contrast: Floats
    beyond: Bools


def find_unexplained(
    scene: Scene,
    rig: Rig,
    pictures: Mapping[str, Primitives],
    indexes: list[EdgeIndex],
    world_from_rig: Floats,
    views: Mapping[str, ViewArcs],
    p: UnexplainedParameters,
) -> UnexplainedElements:
    """Closed curves, long straight edges, curved ones and regions that no predicted edge or blend accounts for, at a
    pose.  Brush texture, shades and highlights are left out, as extraction marks them."""
    pieces = []
    for number, (name, camera) in enumerate(rig.cameras.items()):
        picture, index = pictures[name], indexes[number]
        explained = lie_on(index, views[name].samples, p.reach_px, p.min_cosine)
        share = _share(explained, picture.elements.arc, len(picture.arcs))
        free = _are_edges(picture, index, p) & (share < p.most_explained)
        pose = world_from_rig @ rig.rig_from_camera[name]
        arcs = _find_arcs(scene, camera, pose, picture, index, free, p)
        regions = _find_regions(scene, camera, pose, picture, free, p)
        pieces += [replace(own, camera=np.full(len(own), number)) for own in (arcs, regions)]
    found = UnexplainedElements.stack(pieces)
    return found.take(np.argsort(-found.length * found.contrast, kind="stable"))


def _find_arcs(
    scene: Scene, camera: Camera, pose: Floats, picture: Primitives, index: EdgeIndex, free: Bools,
    p: UnexplainedParameters,
) -> UnexplainedElements:  # fmt: skip
    """Of the `free` arcs those long enough to form something, of camera 0."""
    arcs, owner = picture.arcs, picture.elements.arc
    rows = np.flatnonzero(free & (arcs.length >= np.where(arcs.closed, p.least_closed_px, p.least_px)))
    members = np.flatnonzero(np.isin(owner, rows))
    beyond = np.zeros(len(owner), bool)
    beyond[members] = _see_nothing(scene, camera, pose, index.edges.position[members])
    kind = np.where(arcs.closed, CLOSED, np.where(arcs.kind == LINE, STRAIGHT, CURVED))
    zero, none = np.zeros(len(rows), np.int64), np.full(len(rows), NONE)
    length, contrast, most_beyond = arcs.length[rows], arcs.contrast[rows], _share(beyond, owner, len(arcs))[rows] > 0.5
    return UnexplainedElements(zero, kind[rows], rows, none, _boxes(picture, rows), length, contrast, most_beyond)


def _find_regions(
    scene: Scene, camera: Camera, pose: Floats, picture: Primitives, free: Bools, p: UnexplainedParameters
) -> UnexplainedElements:
    """Regions most of whose border runs along `free` arcs, the border of the picture left out, of camera 0."""
    regions, count = picture.regions, len(picture.regions)
    ring = np.repeat(np.arange(len(regions.ring_region)), np.diff(regions.ring_offsets))
    after = np.arange(1, len(ring) + 1)
    after[regions.ring_offsets[1:] - 1] = regions.ring_offsets[:-1]
    way = (regions.outline[after] - regions.outline).astype(float)
    middle, owner = regions.outline + 0.5 * way, regions.ring_region[ring]
    size = np.array(picture.shape[::-1])
    inside = ((middle >= p.rim_px) & (middle <= size - 1 - p.rim_px)).all(axis=1)
    around = np.bincount(owner, np.linalg.norm(way, axis=1) * inside, count)

    along, arc = regions.border_region, regions.border_arc
    own = regions.border_length * free[arc]
    bordered = np.bincount(along, regions.border_length, count)
    unexplained = np.bincount(along, own, count).astype(float)
    rows = np.flatnonzero(
        (regions.area >= p.least_area_px)
        & (unexplained >= np.maximum(p.least_border * bordered, p.least_closed_px))
        & (bordered > p.least_border * around)
        & (regions.saturated_share < p.most_highlight)
    )
    contrast = np.bincount(along, own * picture.arcs.contrast[arc], count) / np.maximum(unexplained, 1e-9)
    of = np.flatnonzero(np.isin(owner, rows))
    length = np.linalg.norm(way[of], axis=1)
    beyond = np.bincount(owner[of], length * _see_nothing(scene, camera, pose, camera.undistort(middle[of])), count)
    total = np.bincount(owner[of], length, count)
    box = np.stack([regions.x0, regions.y0, regions.x1, regions.y1], axis=1)
    zero, kind, none = np.zeros(len(rows), np.int64), np.full(len(rows), REGION), np.full(len(rows), NONE)
    most_beyond = beyond[rows] > 0.5 * total[rows]
    return UnexplainedElements(zero, kind, none, rows, box[rows], unexplained[rows], contrast[rows], most_beyond)


def lie_on(index: EdgeIndex, seen: VisibleArcs, reach_px: float, min_cosine: float) -> Bools:
    """Which elements lie within a reach of predicted arcs of about their direction."""
    from scipy.spatial import cKDTree

    edges = index.edges
    if not len(seen.arc):
        return np.zeros(len(edges.position), bool)
    distance, nearest = cKDTree(seen.pixel).query(edges.position, distance_upper_bound=reach_px)
    direction = seen.direction[np.where(np.isfinite(distance), nearest, 0)]
    across = np.abs(edges.normal[:, 1] * direction[:, 0] - edges.normal[:, 0] * direction[:, 1])
    return np.asarray(np.isfinite(distance) & (across > min_cosine))


def _are_edges(picture: Primitives, index: EdgeIndex, p: UnexplainedParameters) -> Bools:
    """Which arcs are no texture, shading or highlight, and of clear contrast.  What closes around something dark is the
    border of that, not of the highlight around."""
    arcs = picture.arcs
    is_highlight = (arcs.highlight >= p.most_highlight) & ~(arcs.closed & _is_dark_inside(picture))
    real = (arcs.texture < p.most_texture) & ~is_highlight
    # In a picture without texture most elements are edges of the part.
    clear = min(p.least_contrast * index.texture, p.clear_share * index.edges.grey_range)
    return np.asarray(real & (arcs.contrast > clear))


def _is_dark_inside(picture: Primitives) -> Bools:
    """Of arcs that close, whether the bright side of their elements lies outside."""
    elements, arcs = picture.elements, picture.arcs
    own = np.flatnonzero(elements.arc >= 0)
    arc, count = elements.arc[own], len(arcs)
    number = np.maximum(np.bincount(arc, minlength=count), 1)
    out = np.zeros(count)
    for at, way in ((elements.x[own], elements.nx[own]), (elements.y[own], elements.ny[own])):
        middle = np.bincount(arc, at, count) / number
        out += np.bincount(arc, (at - middle[arc]) * way, count)
    return out > 0


def _share(of: Bools, owner: Ints, count: int) -> Floats:
    """The share of each arc's elements (n,) that are so."""
    own = owner >= 0
    return np.bincount(owner[own], of[own], count) / np.maximum(np.bincount(owner[own], minlength=count), 1)


def _see_nothing(scene: Scene, camera: Camera, world_from_camera: Floats, pixel: Floats) -> Bools:
    """Where rays through pixels (n, 2) of the camera without distortion meet nothing of the model."""
    rays = np.concatenate([camera.normalise(pixel), np.ones((len(pixel), 1))], axis=1) @ world_from_camera[:3, :3].T
    return np.asarray(scene.rays.nearest(world_from_camera[:3, 3], rays) < 0)


def _boxes(picture: Primitives, rows: Ints) -> Floats:
    """Boxes (n, 4) of arcs by their elements."""
    elements = picture.elements
    first, last = picture.arcs.offsets[rows], picture.arcs.offsets[rows + 1]
    out = np.empty((len(rows), 4))
    bounds = np.stack([first, last], axis=1).ravel()
    at = np.minimum(bounds, len(elements.x) - 1)
    for column, (values, least) in enumerate(
        ((elements.x, True), (elements.y, True), (elements.x, False), (elements.y, False))
    ):
        pick = np.minimum if least else np.maximum
        out[:, column] = pick.reduceat(values, at)[::2] if len(rows) else 0.0
    return out
