-- Relations of circles in space joined with those of an object's circles: alike in both radii, in the distance of the
-- centres and in the angles of normals and connecting line.  Relations of the scene with the fewest pairs like them come
-- first, and whole, until there are `most` of them: what repeats a thousand times says little.  Of each at most
-- `most_of_relation` are taken, evenly among all: the others are the same seen from elsewhere along a pattern.
-- Takes object_id, scene_relation (unit_a, unit_b, radius_a, radius_b, distance, normals, rise_a, rise_b; each pair in
-- both orders) as a relation, radius_mm and radius_share, distance_mm, cosine (by which they may differ),
-- most_of_relation, most;
-- gives unit_a, unit_b, circle_a, circle_b, alike (how many pairs of the model the relation is like).
WITH step AS (
    SELECT -1 AS by UNION ALL SELECT 0 UNION ALL SELECT 1
),
-- Distances that agree lie in one bin or in neighbouring ones.
scene AS (
    SELECT s.*, CAST(floor(s.distance / :distance_mm) AS INTEGER) + step.by AS bin,
        least(s.unit_a, s.unit_b) AS low, greatest(s.unit_a, s.unit_b) AS high
    FROM scene_relation AS s
    CROSS JOIN step
),
model AS (
    SELECT class_no, pairs, radius_a, radius_b, distance, normals, rise_a, rise_b,
        CAST(floor(distance / :distance_mm) AS INTEGER) AS bin
    FROM circle_relation
    WHERE object_id = :object_id
),
matched AS (
    SELECT s.unit_a, s.unit_b, s.low, s.high, m.class_no, m.pairs
    FROM scene AS s
    JOIN model AS m ON m.bin = s.bin
    WHERE abs(m.distance - s.distance) <= :distance_mm
        AND abs(m.radius_a - s.radius_a) <= :radius_mm + :radius_share * s.radius_a
        AND abs(m.radius_b - s.radius_b) <= :radius_mm + :radius_share * s.radius_b
        AND abs(m.normals - s.normals) <= :cosine
        AND abs(m.rise_a - s.rise_a) <= :cosine
        AND abs(m.rise_b - s.rise_b) <= :cosine
),
counted AS (
    SELECT low, high, sum(pairs) AS alike
    FROM matched
    GROUP BY low, high
),
-- No more relations than give `most` pairs: those behind are not joined with pairs at all.
ranked AS (
    SELECT low, high, alike,
        sum(least(alike, :most_of_relation)) OVER (ORDER BY alike, low, high ROWS UNBOUNDED PRECEDING) AS so_far
    FROM counted
),
joined AS (
    SELECT m.unit_a, m.unit_b, p.circle_a, p.circle_b, r.alike,
        row_number() OVER pairs_of AS place, count(*) OVER (PARTITION BY r.low, r.high) AS kept
    FROM ranked AS r
    JOIN matched AS m ON m.low = r.low AND m.high = r.high
    JOIN circle_pair AS p ON p.object_id = :object_id AND p.class_no = m.class_no
    WHERE r.so_far <= :most
    WINDOW pairs_of AS (PARTITION BY r.low, r.high ORDER BY p.circle_a, p.circle_b, m.unit_a)
)
SELECT unit_a, unit_b, circle_a, circle_b, alike
FROM joined
WHERE kept <= :most_of_relation
    OR floor(place * CAST(:most_of_relation AS DOUBLE PRECISION) / kept)
        > floor((place - 1) * CAST(:most_of_relation AS DOUBLE PRECISION) / kept)
ORDER BY alike, unit_a, unit_b, circle_a, circle_b
