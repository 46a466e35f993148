-- Circles that ellipses of one picture may be, joined in pairs with pairs of an object's circles.  An ellipse and a
-- radius give a circle in space: so each pair of ellipses is looked at with each pair of radii that the object relates.
-- What they then are in space, the distance of the centres and the angles of normals and connecting line, has to agree
-- with a class of the object's relations, as well as the sizes of the ellipses say how far off the circles are. Pairs
-- in space with the fewest pairs like them come first, and whole, until there are `most`; of each at most
-- `most_of_relation` are taken, evenly among all: the others are the same seen from elsewhere along a pattern.
-- Takes object_id, seen_circle (unit, ellipse_no, x, y, z: centre for the radius 1; nx, ny, nz: unit normal to the
-- camera; size_share, tilt: standard deviations of the size and of the turn, rad) as a relation, radius_step (mm),
-- distance_mm and distance_share, most_mm (mm: by which distances may differ at most), turn (rad), along (cosine of
-- normal and connecting line beyond which they leave a turn about both open), least_distance, greatest_distance,
-- most_of_relation, most;
-- gives unit_a, unit_b, circle_a, circle_b, alike (how many pairs of the object the pair in space is like).
WITH class AS (
    SELECT class_no, pairs, CAST(radius_a AS DOUBLE PRECISION) AS radius_a, CAST(radius_b AS DOUBLE PRECISION) AS radius_b,
        CAST(round(radius_a / :radius_step) AS INTEGER) AS size_a, CAST(round(radius_b / :radius_step) AS INTEGER) AS size_b,
        CAST(distance AS DOUBLE PRECISION) AS distance, acos(least(CAST(normals AS DOUBLE PRECISION), 1)) AS lean,
        acos(least(CAST(rise_a AS DOUBLE PRECISION), 1)) AS rise_a, acos(least(CAST(rise_b AS DOUBLE PRECISION), 1)) AS rise_b
    FROM circle_relation
    WHERE object_id = :object_id AND rise_a <= :along
),
size AS (
    SELECT size_a, size_b, avg(radius_a) AS radius_a, avg(radius_b) AS radius_b
    FROM class
    GROUP BY size_a, size_b
),
lean AS (
    SELECT round(lean / 0.02) * 0.02 AS angle
    FROM class
    GROUP BY 1
),
-- Products of two circles of radius 1, of which follow those of any radii.
unit_pair AS (
    SELECT a.unit AS unit_a, b.unit AS unit_b, a.tilt AS tilt_a, b.tilt AS tilt_b,
        a.size_share AS share_a, b.size_share AS share_b, sqrt(a.tilt * a.tilt + b.tilt * b.tilt) AS tilt,
        acos(least(abs(a.nx * b.nx + a.ny * b.ny + a.nz * b.nz), 1)) AS lean,
        a.x * a.x + a.y * a.y + a.z * a.z AS aa, a.x * b.x + a.y * b.y + a.z * b.z AS ab,
        b.x * b.x + b.y * b.y + b.z * b.z AS bb,
        a.nx * a.x + a.ny * a.y + a.nz * a.z AS na, a.nx * b.x + a.ny * b.y + a.nz * b.z AS nb,
        b.nx * a.x + b.ny * a.y + b.nz * a.z AS ma, b.nx * b.x + b.ny * b.y + b.nz * b.z AS mb
    FROM seen_circle AS a
    JOIN seen_circle AS b ON b.ellipse_no <> a.ellipse_no
),
likely AS (
    SELECT *
    FROM unit_pair AS u
    WHERE EXISTS (SELECT 1 FROM lean AS t WHERE abs(t.angle - u.lean) <= u.tilt + 0.01)
),
-- Two circles in space: their distance, where it is one that the object relates, and how far off each end may be.
spaced AS (
    SELECT u.*, s.size_a, s.size_b, s.radius_a, s.radius_b,
        sqrt(greatest(s.radius_b * s.radius_b * bb - 2 * s.radius_a * s.radius_b * ab + s.radius_a * s.radius_a * aa, 0)) AS distance
    FROM likely AS u
    CROSS JOIN size AS s
),
scene AS (
    SELECT unit_a, unit_b, size_a, size_b, distance, lean, tilt,
        least(:most_mm, :distance_mm + :distance_share * distance + sqrt(
            power(radius_a * (radius_b * ab - radius_a * aa) / distance * share_a, 2)
            + power(radius_b * (radius_b * bb - radius_a * ab) / distance * share_b, 2))) AS off,
        :turn + sqrt(power(radius_a * share_a, 2) * aa + power(radius_b * share_b, 2) * bb) / distance AS turned,
        tilt_a, tilt_b,
        acos(least(abs(radius_b * nb - radius_a * na) / distance, 1)) AS rise_a,
        acos(least(abs(radius_b * mb - radius_a * ma) / distance, 1)) AS rise_b,
        CAST(floor(distance / :most_mm) AS INTEGER) AS bin
    FROM spaced
    WHERE distance BETWEEN :least_distance AND :greatest_distance
        AND abs(radius_b * nb - radius_a * na) <= :along * distance
),
matched AS (
    SELECT s.unit_a, s.unit_b, s.size_a, s.size_b, m.class_no, m.pairs
    FROM scene AS s
    JOIN (
        SELECT *, CAST(floor(distance / :most_mm) AS INTEGER) + step.bins AS bin
        FROM class
        CROSS JOIN (VALUES (-1), (0), (1)) AS step (bins)
    ) AS m ON m.size_a = s.size_a AND m.size_b = s.size_b AND m.bin = s.bin
    WHERE abs(m.distance - s.distance) <= s.off
        AND abs(m.lean - s.lean) <= s.tilt
        AND abs(m.rise_a - s.rise_a) <= s.turned + s.tilt_a
        AND abs(m.rise_b - s.rise_b) <= s.turned + s.tilt_b
),
ranked AS (
    SELECT unit_a, unit_b, size_a, size_b, sum(pairs) AS alike, sum(least(sum(pairs), :most_of_relation)) OVER (
        ORDER BY sum(pairs), greatest(unit_a, unit_b), unit_a, unit_b, size_a, size_b ROWS UNBOUNDED PRECEDING) AS so_far
    FROM matched
    GROUP BY unit_a, unit_b, size_a, size_b
),
paired AS (
    SELECT r.size_a, r.size_b, r.alike, m.unit_a, m.unit_b,
        unnest(c.circles[1:(array_length(c.circles, 1) / 2)]) AS circle_a,
        unnest(c.circles[(array_length(c.circles, 1) / 2 + 1):(array_length(c.circles, 1))]) AS circle_b
    FROM ranked AS r
    JOIN matched AS m
        ON m.unit_a = r.unit_a AND m.unit_b = r.unit_b AND m.size_a = r.size_a AND m.size_b = r.size_b
    JOIN circle_relation AS c ON c.object_id = :object_id AND c.class_no = m.class_no
    WHERE r.so_far <= :most
),
joined AS (
    SELECT unit_a, unit_b, circle_a, circle_b, alike,
        row_number() OVER (PARTITION BY unit_a, unit_b, size_a, size_b ORDER BY circle_a, circle_b) AS place,
        count(*) OVER (PARTITION BY unit_a, unit_b, size_a, size_b) AS kept
    FROM paired
)
SELECT unit_a, unit_b, circle_a, circle_b, alike
FROM joined
WHERE kept <= :most_of_relation
    OR floor(place * CAST(:most_of_relation AS DOUBLE PRECISION) / kept)
        > floor((place - 1) * CAST(:most_of_relation AS DOUBLE PRECISION) / kept)
ORDER BY alike, unit_a, unit_b, circle_a, circle_b
