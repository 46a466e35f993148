"""Segmentation of a triangle mesh into planes, cylinders, cones, spheres, tori and free-form regions.

Coplanar triangles make patches.  A patch with its neighbours across long, smooth edges determines a surface of each
kind; patches that agree about theirs make a candidate, which grows over neighbours that lie on it, whoever else claims
them.  The candidates that explain the greatest area are taken, one after the other."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints, count_from
from relmodel.geometry.congruence import components, greatest
from relmodel.readers.mesh.fit import (
    CONE,
    CYLINDER,
    FREE,
    KINDS,
    PARAMETERS,
    PLANE,
    SPHERE,
    TORUS,
    distances,
    fit_surfaces,
    normals_at,
)  # fmt: skip
from relmodel.readers.mesh.triangles import (
    DEFAULTS,
    MeshEdges,
    Patches,
    area_normals,
    cut_patches,
    mean_planes,
    rounding,
    slim,
)

_P = DEFAULTS.segments
_CURVED = (CYLINDER, CONE, SPHERE, TORUS)
_SPARE, _DRAWS = (dict(zip(_CURVED, values, strict=True)) for values in (_P.spare_points, _P.draws))
_BONUS = dict(zip(_CURVED, _P.bonus, strict=True))


@dataclass(frozen=True)
class MeshRegions:
    """Regions of a mesh: of each triangle its region; of each region its kind and row (`fit.py`, NaN where none)."""

    of_triangle: Ints
    kind: npt.NDArray[np.str_]
    surface: Floats  # (n, 8)


@dataclass
class _Surfaces:
    """Candidates: kind (n,), row (n, 8), angle facets may lean by (n,), sorted pairs surface * patches + patch."""

    kind: Ints
    row: Floats
    lean: Floats
    pairs: Ints


def segment_mesh(vertices: Floats, triangles: Ints, edges: MeshEdges, tolerance: float) -> MeshRegions:
    """Segment a mesh into regions, numbered by first triangle; tolerance (mm) is how far a vertex may be off."""
    patches = cut_patches(vertices, triangles, edges, tolerance)
    work = _Segmentation(vertices, triangles, patches)
    kind, row, owner = np.empty(0, np.int64), np.empty((0, 8)), np.full(len(patches.area), -1)
    for level in (max(_P.exact_mm, 2 * rounding(vertices)), tolerance):
        owner = work.absorb(owner, kind, row, level)
        new = work.candidates(owner, level)
        kind, row, owner = work.take(new, kind, row, owner)
    owner = work.merge(work.absorb(owner, kind, row, 2 * tolerance), kind, row, tolerance)
    owner = work.reject_spurious(owner, len(kind))
    owner, flat = work.rest(owner, len(kind), tolerance)
    kind = np.append(kind, np.where(flat, PLANE, FREE))
    row = np.concatenate([row, np.full((len(flat), 8), np.nan)])
    _, first, region = np.unique(owner[patches.of_triangle], return_index=True, return_inverse=True)
    order = np.argsort(first)
    number = owner[patches.of_triangle[first[order]]]
    return MeshRegions(np.argsort(order)[region.ravel()], np.array(KINDS)[kind[number]], row[number])


def smooth_regions(triangles: Ints, edges: MeshEdges) -> MeshRegions:
    """Regions between creases, all of them free-form: of a mesh that only occludes."""
    smooth = np.abs(edges.angle) < _P.free_rad  # no free edge is
    region = components(len(triangles), edges.triangle_a[smooth], edges.triangle_b[smooth])
    count = int(region.max()) + 1
    return MeshRegions(region, np.full(count, KINDS[FREE]), np.full((count, 8), np.nan))


def fit_faces(
    vertices: Floats, triangles: Ints, faces: Ints, tolerance: float, normals: Floats | None = None
) -> MeshRegions:
    """Regions of a mesh whose faces (m,) are known, in their order: of each the simplest surface that holds all its
    vertices, free-form if none does.  normals (m, 3, 3): of the surface at the triangles' corners, where known."""
    _, region = np.unique(faces, return_inverse=True)
    region = region.ravel()
    count = int(region.max()) + 1
    kind = np.where(mean_planes(vertices, triangles, region)[0] <= tolerance, PLANE, FREE)
    row = np.full((count, 8), np.nan)
    order = np.argsort(region, kind="stable")
    area = area_normals(vertices, triangles)[order]
    corner = vertices[triangles[order]]
    start = np.searchsorted(region[order], np.arange(count + 1))
    if normals is None:
        normal, feet, normal_start = area, corner.mean(axis=1), start
    else:
        size = np.linalg.norm(area, axis=1)[:, None, None]
        normal, feet, normal_start = (size * normals[order]).reshape(-1, 3), corner.reshape(-1, 3), 3 * start
    which = np.repeat(np.arange(count), np.diff(normal_start))
    unit = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    pairs = np.unique(np.repeat(region, 3) * np.int64(len(vertices)) + triangles.ravel())
    face, vertex = np.divmod(pairs, len(vertices))
    points = vertices[vertex]
    point_start = np.searchsorted(face, np.arange(count + 1))
    directions = np.concatenate([np.eye(3), unit[np.flatnonzero(kind[which] == PLANE)[:1]]])
    for k in (CYLINDER, CONE, SPHERE, TORUS):
        found, away = fit_surfaces(k, points, point_start, normal, feet, normal_start, directions)
        cosine = np.abs(np.sum(normals_at(np.full(len(which), k), found[which], feet) * unit, axis=1))
        lean = np.cos(_P.given_rad if normals is not None else _P.smooth_rad / 2)
        good = (kind == FREE) & (away <= tolerance) & (np.bincount(which, cosine < lean, count) == 0)
        good &= np.diff(point_start) >= PARAMETERS[k] + (_SPARE[k] if normals is None else 0)
        kind[good], row[good] = k, found[good]
    return MeshRegions(region, np.array(KINDS)[kind], row)


class _Segmentation:
    def __init__(self, vertices: Floats, triangles: Ints, patches: Patches) -> None:
        from scipy.sparse import csr_array

        self.vertices, self.triangles, self.patches = vertices, triangles, patches
        self.count = len(patches.area)
        of = patches.of_triangle
        # The normal of a sliver is not determined, and its corners may be anywhere along its neighbours.
        thin = slim(vertices, triangles)
        self.known = np.bincount(of, ~thin, minlength=self.count) > 0
        thin &= self.known[of]
        pair = np.unique(np.repeat(of[~thin], 3) * np.int64(len(vertices)) + triangles[~thin].ravel())
        patch, vertex = np.divmod(pair, len(vertices))
        start = np.searchsorted(patch, np.arange(self.count + 1))
        self.corners = csr_array((np.ones(len(vertex), np.int8), vertex, start), shape=(self.count, len(vertices)))
        self.smooth = patches.angle < _P.smooth_rad
        self.bend = greatest(patches.angle[self.smooth], patches.a[self.smooth], self.count)
        widest = greatest(patches.width[patches.b[self.smooth]], patches.a[self.smooth], self.count)
        # A plane is much wider than the strips that it runs smoothly into.
        self.plane = patches.flat & (patches.width > _P.wide * widest)

        self.near = self._csr(patches.a[self.smooth], patches.b[self.smooth], self.count)
        big = np.flatnonzero(self.plane)[np.argsort(-patches.area[self.plane], kind="stable")][:3]
        normal = self._unit(patches.normal[big])
        between = np.cross(normal[:, None], normal[None]).reshape(-1, 3)
        between = self._unit(between[np.linalg.norm(between, axis=1) > 0.1])
        self.directions = np.concatenate([normal, between, np.eye(3)])
        alike = np.triu(np.abs(self.directions @ self.directions.T) > 0.999, 1).any(axis=0)
        self.directions = self.directions[~alike][: _P.most_directions]

    @staticmethod
    def _unit(v: Floats) -> Floats:
        return np.asarray(v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-300))

    def candidates(self, owner: Ints, level: float) -> _Surfaces:
        """Curved surfaces that hold patches without an owner within `level` (mm); they overlap."""
        from scipy.sparse import eye_array

        p = self.patches
        open_ = (owner < 0) & ~self.plane & self.known
        joined = np.flatnonzero(self.smooth & open_[p.a] & open_[p.b])
        a, b, length = p.a[joined], p.b[joined], p.length[joined]
        longest = greatest(length, a, self.count)
        seeds = np.flatnonzero(np.bincount(a, minlength=self.count) > 0)
        found, whole = [], np.zeros(self.count, bool)
        for kind, spare in ((CYLINDER, 2), (CONE, 2), (SPHERE, 2), (TORUS, 12), (TORUS, 4)):
            across = (length >= _P.long * longest[a]) | (kind == TORUS)  # which bends both ways
            step = (self._csr(a[across], b[across], self.count) + eye_array(self.count, dtype=np.int32)).tocsr()
            left = seeds[~whole[seeds]]
            ring = step[left]
            for _ in range(3):  # the smallest group that determines the surface
                enough = np.diff((ring @ self.corners).indptr) >= PARAMETERS[kind] + spare
                if enough.any():
                    found.append(self._seeded(kind, left[enough], ring[np.flatnonzero(enough)].tocsr(), level))
                    self._mark_whole(found[-1], a, b, whole)
                left = left[~enough]
                ring = (ring[np.flatnonzero(~enough)] @ step).tocsr()
        return self._joined(found)

    def _mark_whole(self, found: _Surfaces, a: Ints, b: Ints, whole: Bools) -> None:
        """Mark patches of candidates that run smoothly into nothing else: no other kind explains more of them."""
        number, patch = np.divmod(found.pairs, self.count)
        candidate = np.full(self.count, -1)
        candidate[patch] = number
        leaves = np.zeros(len(found.kind), bool)
        leaves[candidate[a[(candidate[a] >= 0) & (candidate[a] != candidate[b])]]] = True
        ok = (candidate >= 0) & ~whole
        ok[ok] = ~leaves[candidate[ok]]
        whole |= ok

    def _joined(self, found: list[_Surfaces]) -> _Surfaces:
        none = np.empty(0, np.int64)
        found = [_Surfaces(none, np.empty((0, 8)), np.empty(0), none), *found]
        shift = self.count * np.cumsum([0, *(len(f.kind) for f in found)])
        kind, row, lean = (np.concatenate([getattr(f, name) for f in found]) for name in ("kind", "row", "lean"))
        pairs = np.concatenate([f.pairs + s for f, s in zip(found, shift, strict=False)])
        return _Surfaces(kind, row, lean, pairs)

    def fit(self, kind: int, groups: Any, begin: Floats | None = None) -> tuple[Floats, Floats, Ints]:
        """Rows, greatest distances and numbers of points of groups of patches (CSR)."""
        points = (groups @ self.corners).tocsr()
        normals, feet = self.patches.normal[groups.indices], self.patches.middle[groups.indices]
        row, away = fit_surfaces(
            kind, self.vertices[points.indices], points.indptr, normals, feet, groups.indptr, self.directions, begin
        )
        return row, away, np.diff(points.indptr)

    def _seeded(self, kind: int, seeds: Ints, groups: Any, level: float) -> _Surfaces:
        """Candidates of one kind, from groups of patches about seeds.  A seed stands for those about it."""
        rng = np.random.default_rng(0)
        chosen = np.zeros(len(seeds), bool)
        for _ in range(_DRAWS[kind]):
            rank = np.full(self.count, -1)
            rank[seeds] = rng.permutation(len(seeds))
            chosen |= rank[seeds] == np.maximum.reduceat(rank[groups.indices], groups.indptr[:-1])
        groups = groups[np.flatnonzero(chosen)].tocsr()
        number = np.repeat(np.arange(groups.shape[0]), np.diff(groups.indptr))
        row, away, count = self.fit(kind, groups)
        lean = self._lean(number, groups.indices, len(row))
        steep = self._off(np.full(len(row), kind), row, lean, number, groups.indices)[1]
        # The facets stand off a surface by much more than its points do: else anything fits.
        sag = np.abs(distances(np.full(len(number), kind), row[number], self.patches.middle[groups.indices]))
        good = (away <= level) & (count >= PARAMETERS[kind] + _SPARE[kind])
        good &= np.bincount(number, steep, len(row)) == 0
        good &= np.maximum.reduceat(sag, groups.indptr[:-1]) > 3 * away
        pairs = number * np.int64(self.count) + groups.indices
        return self._grown(kind, row, pairs[good[number]], level)

    def _lean(self, number: Ints, patch: Ints, count: int) -> Floats:
        return np.minimum(greatest(_P.lean * self.bend[patch], number, count), _P.most_lean_rad)

    def _off(self, kind: Ints, row: Floats, lean: Floats, surface: Ints, patch: Ints) -> tuple[Floats, Bools]:
        """Of pairs the greatest distance of the patch's corners from the surface, and whether it leans against it."""
        if not len(surface):
            return np.empty(0), np.empty(0, bool)
        taken = self.corners[patch]
        which = np.repeat(np.arange(len(patch)), np.diff(taken.indptr))
        points, s = self.vertices[taken.indices], surface[which]
        away = np.abs(distances(kind[s], row[s], points))
        normal = self._unit(self.patches.normal[patch])[which]
        cosine = np.abs(np.einsum("ij,ij->i", normals_at(kind[s], row[s], points), normal))
        cosine[np.isnan(cosine)] = 1.0
        steep = self.known[patch] & (np.minimum.reduceat(cosine, taken.indptr[:-1]) < np.cos(lean[surface]))
        return np.maximum.reduceat(away, taken.indptr[:-1]), steep

    def _grown(self, kind: int, row: Floats, pairs: Ints, level: float) -> _Surfaces:
        """Candidates grown over neighbours that lie on them, by twice as many rings each time before they are fitted
        again, until they hold as much as they can."""
        n, kinds = np.int64(self.count), np.full(len(row), kind)
        lean = np.zeros(len(row))
        for rings in _P.rings:
            if not len(pairs):
                break
            number, patch = np.divmod(pairs, n)
            lean = self._lean(number, patch, len(row))
            # A small candidate says only roughly where its surface goes on: it takes what may belong, and is refitted.
            near = np.full(len(row), 2 * level)
            if rings == 1:
                sag = np.abs(distances(kinds[number], row[number], self.patches.middle[patch]))
                np.maximum.at(near, number, _P.share_of_sag * sag)
            before = tried = new = pairs
            for _ in range(rings):
                around = (self._csr(*np.divmod(new, n), len(row)) @ self.near).tocoo()
                new = np.setdiff1d(around.row.astype(np.int64) * n + around.col, tried, assume_unique=True)
                new = new[~self.plane[new % n]]
                off, steep = self._off(kinds, row, lean, new // n, new % n)
                tried = np.union1d(tried, new)
                new = new[(off <= near[new // n]) & ~steep]
                if not len(new):
                    break
                pairs = self._largest(np.union1d(pairs, new), len(row))
                new = np.intersect1d(new, pairs, assume_unique=True)
            for last in (False, True):
                number, place = np.unique(pairs // n, return_inverse=True)
                groups = self._csr(place, pairs % n, len(number))
                row[number], away, points = self.fit(kind, groups, row[number])
                if not last:
                    off = self._off(kinds, row, lean, pairs // n, pairs % n)[0]
                    pairs = pairs[off <= np.maximum(2 * level, 0.5 * away[place])]
            good = (away <= 2 * level) & (np.diff(groups.indptr) >= _P.least)
            good &= points >= PARAMETERS[kind] + _SPARE[kind]
            pairs = pairs[good[place]]
            if rings > 1 and np.array_equal(pairs, before):
                break
        kept, number = np.unique(pairs // n, return_inverse=True)
        return _Surfaces(kinds[kept], row[kept], lean[kept], number.ravel() * n + pairs % n)

    def _largest(self, pairs: Ints, count: int) -> Ints:
        """Pairs of the candidates that hold more patches than larger ones of this kind hold of theirs."""
        number, patch = np.divmod(pairs, np.int64(self.count))
        rank = np.argsort(np.argsort(np.bincount(number, minlength=count), kind="stable"))
        best = np.full(self.count, -1)
        np.maximum.at(best, patch, rank[number])
        own = np.bincount(number, best[patch] == rank[number], count)
        return pairs[(2 * own >= np.bincount(number, minlength=count))[number]]

    def _csr(self, row: Ints, column: Ints, count: int) -> Any:
        from scipy.sparse import csr_array

        return csr_array((np.ones(len(row), np.int32), (row, column)), shape=(count, self.count))

    def take(self, new: _Surfaces, kind: Ints, row: Floats, owner: Ints) -> tuple[Ints, Floats, Ints]:
        """Owners of patches after the candidates that explain most have taken what is left, and all surfaces."""
        owner = owner.copy()
        number, patch = np.divmod(new.pairs, self.count)
        start = np.searchsorted(number, np.arange(len(new.kind) + 1))
        area = self.patches.area
        worth = np.array([_BONUS[k] for k in new.kind.tolist()]) * np.bincount(number, area[patch], len(new.kind))
        heap = [(-w, i) for i, w in enumerate(worth.tolist())]
        heapq.heapify(heap)
        taken: list[int] = []
        while heap:
            _, i = heapq.heappop(heap)
            own = patch[start[i] : start[i + 1]]
            left = own[owner[own] < 0]
            if len(left) < _P.least:
                continue
            value = _BONUS[int(new.kind[i])] * float(area[left].sum())
            if heap and value < -heap[0][0] - 1e-9 * value:
                heapq.heappush(heap, (-value, i))
                continue
            owner[left] = len(kind) + len(taken)
            taken.append(i)
        return np.append(kind, new.kind[taken]), np.concatenate([row, new.row[taken]]), owner

    def absorb(self, owner: Ints, kind: Ints, row: Floats, level: float) -> Ints:
        """Owners of patches after surfaces have taken the neighbours without one that lie on them within `level`."""
        p, owner = self.patches, owner.copy()
        most = np.full(len(kind), _P.most_lean_rad)
        while True:
            met = np.flatnonzero(self.smooth & (owner[p.a] >= 0) & (owner[p.b] < 0))
            off, steep = self._off(kind, row, most, owner[p.a[met]], p.b[met])
            met, off = met[(off <= level) & ~steep], off[(off <= level) & ~steep]
            if not len(met):
                return owner
            order = np.argsort(-off, kind="stable")
            owner[p.b[met[order]]] = owner[p.a[met[order]]]  # written last: the nearest

    def merge(self, owner: Ints, kind: Ints, row: Floats, level: float) -> Ints:
        """Owners of patches: a surface that runs smoothly into a larger, which holds it within `level`, is of that."""
        p, count = self.patches, len(kind)
        owned = np.flatnonzero(owner >= 0)
        own = owner[owned]
        sag = greatest(np.abs(distances(kind[own], row[own], p.middle[owned])), own, count)  # of middles of facets
        while True:
            met = self.smooth & (owner[p.a] >= 0) & (owner[p.b] >= 0) & (owner[p.a] != owner[p.b])
            area = np.bincount(owner[owner >= 0], p.area[owner >= 0], count)
            small, large = np.divmod(np.unique(owner[p.a[met]] * np.int64(count) + owner[p.b[met]]), count)
            less = (area[small] < area[large]) | ((area[small] == area[large]) & (small > large))
            small, large = small[less], large[less]
            order = np.argsort(owner, kind="stable")
            start = np.searchsorted(owner[order], np.arange(count + 1))
            pair, at = count_from(start[small], np.diff(start)[small])
            off, steep = self._off(kind, row, np.full(count, _P.most_lean_rad), large[pair], order[at])
            off = np.where(steep, np.inf, off)
            worst = greatest(off, pair, len(small), -np.inf)
            good = worst <= np.minimum(level, _P.share_of_sag * sag[large])
            if not good.any():
                return owner
            into = np.arange(count)
            into[small[good]] = large[good]
            while not np.array_equal(into, into[into]):
                into = into[into]
            owner = np.where(owner >= 0, into[owner], -1)

    def reject_spurious(self, owner: Ints, count: int) -> Ints:
        """Owners (-1 none) of patches without the surfaces of a few that run smoothly into free-form ones: some strips
        of a free-form surface always lie on a cylinder or cone."""
        p = self.patches
        longest = greatest(p.length[self.smooth], p.a[self.smooth], self.count)
        long = p.length >= _P.long * longest[p.a]  # at its ends a strip may run into anything
        rim = np.flatnonzero((owner[p.a] >= 0) & (owner[p.a] != owner[p.b]) & long)
        total = np.bincount(owner[p.a[rim]], p.length[rim], count)
        rim = rim[p.angle[rim] < _P.free_rad]
        rim = rim[~self.plane[p.b[rim]]]
        few = np.bincount(owner[owner >= 0], minlength=count) < _P.few
        bends = (p.angle < _P.free_rad) & ~self.plane[p.b]
        dropped = np.zeros(count + 1, bool)
        while True:
            a, b = owner[p.a[rim]], owner[p.b[rim]]
            # A patch that bends on into none of the free ones is a plane.
            loose = (owner < 0) | dropped[owner]
            run_on = np.bincount(p.a[bends & loose[p.b]], minlength=self.count) > 0
            free = ((b < 0) | dropped[b]) & run_on[p.b[rim]]
            either = free | ((b >= 0) & few[b])
            into_free, into_few = (np.bincount(a[at], p.length[rim[at]], count) for at in (free, either))
            new = few & ((into_free > _P.free_rim * total) | (into_few > _P.few_rim * total)) & ~dropped[:count]
            if not new.any():
                return np.where(dropped[owner] & (owner >= 0), -1, owner)
            dropped[:count] |= new

    def rest(self, owner: Ints, curved: int, tolerance: float) -> tuple[Ints, Bools]:
        """Owner of each patch, now of all; owners from `curved` on are new, planes or free-form.

        What no curved surface owns is a plane where it is flat and isolated, or much wider than the strips that it runs
        smoothly into: a free-form surface is tessellated into patches about as wide as their neighbours."""
        p, count = self.patches, self.count
        open_ = (owner[p.a] < 0) & (owner[p.b] < 0)
        # A plane whose boundary is less exact than its inside comes in several patches.
        level = open_ & (p.angle < _P.flat_rad)
        sheet = components(count, p.a[level], p.b[level])
        uneven = mean_planes(self.vertices, self.triangles, sheet[p.of_triangle])[0] > tolerance
        level &= ~uneven[sheet[p.a]]
        sheet = components(count, p.a[level], p.b[level])
        inside = sheet[p.a] == sheet[p.b]
        perimeter = np.bincount(sheet, 2 * p.area / p.width)
        perimeter -= np.bincount(sheet[p.a[inside]], p.length[inside], minlength=len(perimeter))
        area = np.bincount(sheet, p.area)
        width = 2 * area / np.maximum(perimeter, 1e-9 * np.sqrt(area))
        flat = np.ones(len(area), bool)
        np.logical_and.at(flat, sheet, p.flat & (owner < 0))
        bend = open_ & (p.angle < _P.free_rad) & ~inside
        one, two = sheet[p.a[bend]], sheet[p.b[bend]]
        isolated = np.bincount(components(len(area), one, two))[components(len(area), one, two)] <= 2
        neighbour = greatest(width[two], one, len(area))
        # Two single triangles that hardly bend are a twisted quad, and its diagonal is no edge.
        single = np.bincount(sheet[p.of_triangle]) == 1
        twisted = np.zeros(len(area), bool)
        twisted[one[single[one] & single[two] & (p.angle[bend] < _P.twist_rad)]] = True
        plane = flat & ((isolated & ~twisted) | (width > _P.wide * neighbour))
        # A facet that is much wider than those about it, or a sliver, is of the free-form region that it runs into.
        into = np.bincount(one[~plane[two]], p.length[bend][~plane[two]], len(area))
        plane &= (np.bincount(sheet[p.of_triangle]) > 2) | (into < _P.into_free * perimeter)
        join = ~plane[one] & ~plane[two]
        label = components(len(area), one[join], two[join])[sheet]
        owner = np.where(owner >= 0, owner, curved + label)
        out = np.zeros(int(label.max()) + 1, bool)
        out[label[plane[sheet] & (owner >= curved)]] = True
        return owner, out
