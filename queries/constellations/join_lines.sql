-- Relations of straight edges in space joined with those of an object's: alike in angle and distance, and an edge that
-- was seen lies within one of the object.  Relations of the scene with the fewest like them come first, and whole,
-- until there are `most` of them; of each at most `most_of_relation` are taken, evenly among all.
-- Takes the relations scene_pair (unit_a, unit_b, sign_a, sign_b, cosine, distance, cosine_off and distance_off: by
-- which they may differ, low_a, high_a, low_b, high_b: stretches seen) and model_pair (unit_a, unit_b, cosine,
-- distance, low_a, high_a, low_b, high_b), bin_mm (no distance_off is greater), along_mm (by which an edge may be seen
-- beyond its ends), most_of_relation, most;
-- gives unit_a, unit_b, sign_a, sign_b, line_a, line_b, alike (how many pairs of the model the relation is like).
WITH scene AS (  -- distances that agree lie in one bin or in neighbouring ones
    SELECT s.*, CAST(floor(s.distance / :bin_mm) AS INTEGER) + step.bins AS bin,
        least(s.unit_a, s.unit_b) AS low, greatest(s.unit_a, s.unit_b) AS high
    FROM scene_pair AS s
    CROSS JOIN (VALUES (-1), (0), (1)) AS step (bins)
),
model AS (
    SELECT *, CAST(floor(distance / :bin_mm) AS INTEGER) AS bin
    FROM model_pair
),
matched AS (
    SELECT s.low, s.high, s.unit_a, s.unit_b, s.sign_a, s.sign_b, m.unit_a AS line_a, m.unit_b AS line_b
    FROM scene AS s
    JOIN model AS m ON m.bin = s.bin
    WHERE abs(m.distance - s.distance) <= s.distance_off
        AND abs(m.cosine - s.cosine) <= s.cosine_off
        AND s.low_a >= m.low_a - :along_mm AND s.high_a <= m.high_a + :along_mm
        AND s.low_b >= m.low_b - :along_mm AND s.high_b <= m.high_b + :along_mm
),
ranked AS (
    SELECT low, high, count(*) AS alike, sum(least(count(*), :most_of_relation)) OVER (
        ORDER BY count(*), low, high ROWS UNBOUNDED PRECEDING) AS so_far
    FROM matched
    GROUP BY low, high
),
joined AS (
    SELECT m.unit_a, m.unit_b, m.sign_a, m.sign_b, m.line_a, m.line_b, r.alike,
        row_number() OVER (
            PARTITION BY r.low, r.high ORDER BY m.line_a, m.line_b, m.unit_a, m.sign_a, m.sign_b
        ) AS place
    FROM ranked AS r
    JOIN matched AS m ON m.low = r.low AND m.high = r.high
    WHERE r.so_far <= :most
)
SELECT unit_a, unit_b, sign_a, sign_b, line_a, line_b, alike
FROM joined
WHERE alike <= :most_of_relation
    OR floor(place * CAST(:most_of_relation AS DOUBLE PRECISION) / alike)
        > floor((place - 1) * CAST(:most_of_relation AS DOUBLE PRECISION) / alike)
ORDER BY alike, unit_a, unit_b, line_a, line_b, sign_a, sign_b
