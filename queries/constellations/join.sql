-- Pairs of circles in space joined with pairs of the model's circles: alike in both radii, in the distance of the
-- centres and in the angles of normals and connecting line.  Pairs of the scene with the fewest like them in the model
-- come first, and whole, until there are `most` of them: what repeats a thousand times says little.
-- Takes scene_circle and model_circle (no, x, y, z, nx, ny, nz, radius) as relations, least and greatest (mm between
-- centres), radius_mm and radius_share, distance_mm, cosine (difference of the angles' cosines), along (cosine beyond
-- which the connecting line runs along a normal, and turns nothing), most;
-- gives scene_a, scene_b, model_a, model_b, alike (how many pairs of the model the pair of the scene is like).
WITH scene_pair AS (
    SELECT a.no AS a, b.no AS b, a.radius AS radius_a, b.radius AS radius_b,
        sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y) + (b.z - a.z) * (b.z - a.z)) AS distance,
        abs(a.nx * b.nx + a.ny * b.ny + a.nz * b.nz) AS normals,
        abs(a.nx * (b.x - a.x) + a.ny * (b.y - a.y) + a.nz * (b.z - a.z)) AS rise_a,
        abs(b.nx * (b.x - a.x) + b.ny * (b.y - a.y) + b.nz * (b.z - a.z)) AS rise_b
    FROM scene_circle AS a
    JOIN scene_circle AS b ON a.no < b.no
),
model_pair AS (
    SELECT a.no AS a, b.no AS b, a.radius AS radius_a, b.radius AS radius_b,
        sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y) + (b.z - a.z) * (b.z - a.z)) AS distance,
        abs(a.nx * b.nx + a.ny * b.ny + a.nz * b.nz) AS normals,
        abs(a.nx * (b.x - a.x) + a.ny * (b.y - a.y) + a.nz * (b.z - a.z)) AS rise_a,
        abs(b.nx * (b.x - a.x) + b.ny * (b.y - a.y) + b.nz * (b.z - a.z)) AS rise_b
    FROM model_circle AS a
    JOIN model_circle AS b ON a.no <> b.no
        AND abs(b.x - a.x) <= :greatest AND abs(b.y - a.y) <= :greatest AND abs(b.z - a.z) <= :greatest
),
-- Distances that agree lie in one bin or in neighbouring ones.
step AS (
    SELECT -1 AS by UNION ALL SELECT 0 UNION ALL SELECT 1
),
scene_bin AS (
    SELECT p.*, CAST(floor(p.distance / :distance_mm) AS INTEGER) + s.by AS bin
    FROM scene_pair AS p
    CROSS JOIN step AS s
    WHERE p.distance BETWEEN :least AND :greatest AND p.rise_a <= :along * p.distance
),
model_bin AS (
    SELECT p.*, CAST(floor(p.distance / :distance_mm) AS INTEGER) AS bin
    FROM model_pair AS p
    WHERE p.distance BETWEEN :least - :distance_mm AND :greatest + :distance_mm
),
joined AS (
    SELECT s.a AS scene_a, s.b AS scene_b, m.a AS model_a, m.b AS model_b,
        count(*) OVER (PARTITION BY s.a, s.b) AS alike
    FROM scene_bin AS s
    JOIN model_bin AS m ON m.bin = s.bin
    WHERE abs(m.distance - s.distance) <= :distance_mm
        AND abs(m.radius_a - s.radius_a) <= :radius_mm + :radius_share * s.radius_a
        AND abs(m.radius_b - s.radius_b) <= :radius_mm + :radius_share * s.radius_b
        AND abs(m.normals - s.normals) <= :cosine
        AND abs(m.rise_a / m.distance - s.rise_a / s.distance) <= :cosine
        AND abs(m.rise_b / m.distance - s.rise_b / s.distance) <= :cosine
),
ranked AS (
    SELECT scene_a, scene_b, model_a, model_b, alike,
        rank() OVER (ORDER BY alike, scene_a, scene_b) AS place
    FROM joined
)
SELECT scene_a, scene_b, model_a, model_b, alike
FROM ranked
WHERE place <= :most
ORDER BY alike, scene_a, scene_b, model_a, model_b
