-- Relations of circles in space joined with those of an object's circles: alike in both radii, in the distance of the
-- centres and in the angles of normals and connecting line.  Relations of the scene with the fewest pairs like them
-- come first, and whole, until there are `most` of them: what repeats a thousand times says little.  Of each at most
-- `most_of_relation` are taken, evenly among all: the others are the same seen from elsewhere along a pattern.
-- Takes object_id, scene_relation (unit_a, unit_b, radius_a, radius_b, distance, normals, rise_a, rise_b, and of each
-- of these its standard deviation, as radius_a_sigma) as a relation, sigmas by which they may differ, least_radius_mm,
-- least_mm to bin_mm, least_cosine to most_cosine (by which they may at least, and at most), along (cosine of a normal
-- and the connecting line beyond which they leave a turn about both open), most_of_relation, most;
-- gives unit_a, unit_b, circle_a, circle_b, alike (how many pairs of the model the relation is like).
WITH allowed AS (
    SELECT unit_a, unit_b, radius_a, radius_b, distance, normals, rise_a, rise_b,
        greatest(:least_radius_mm, :sigmas * radius_a_sigma) AS radius_a_off,
        greatest(:least_radius_mm, :sigmas * radius_b_sigma) AS radius_b_off,
        least(:bin_mm, greatest(:least_mm, :sigmas * distance_sigma)) AS distance_off,
        least(:most_cosine, greatest(:least_cosine, :sigmas * normals_sigma)) AS normals_off,
        least(:most_cosine, greatest(:least_cosine, :sigmas * rise_a_sigma)) AS rise_a_off,
        least(:most_cosine, greatest(:least_cosine, :sigmas * rise_b_sigma)) AS rise_b_off
    FROM scene_relation
),
-- Either circle comes first.
ordered AS (
    SELECT unit_a AS low, unit_b AS high, * FROM allowed
    UNION ALL
    SELECT unit_a, unit_b, unit_b, unit_a, radius_b, radius_a, distance, normals, rise_b, rise_a,
        radius_b_off, radius_a_off, distance_off, normals_off, rise_b_off, rise_a_off
    FROM allowed
),
-- Distances that agree lie in one bin or in neighbouring ones.
scene AS (
    SELECT s.*, CAST(floor(s.distance / :bin_mm) AS INTEGER) + step.bins AS bin
    FROM ordered AS s
    CROSS JOIN (VALUES (-1), (0), (1)) AS step (bins)
    WHERE s.rise_a <= :along
),
model AS (
    SELECT class_no, pairs, radius_a, radius_b, distance, normals, rise_a, rise_b,
        CAST(floor(distance / :bin_mm) AS INTEGER) AS bin
    FROM circle_relation
    WHERE object_id = :object_id AND rise_a <= :along + :least_cosine
),
matched AS (
    SELECT s.unit_a, s.unit_b, s.low, s.high, m.class_no, m.pairs
    FROM scene AS s
    JOIN model AS m ON m.bin = s.bin
    WHERE abs(m.distance - s.distance) <= s.distance_off
        AND abs(m.radius_a - s.radius_a) <= s.radius_a_off
        AND abs(m.radius_b - s.radius_b) <= s.radius_b_off
        AND abs(m.normals - s.normals) <= s.normals_off
        AND abs(m.rise_a - s.rise_a) <= s.rise_a_off
        AND abs(m.rise_b - s.rise_b) <= s.rise_b_off
),
-- No more relations than give `most` pairs: those behind are not joined with pairs at all.
ranked AS (
    SELECT low, high, sum(pairs) AS alike, sum(least(sum(pairs), :most_of_relation)) OVER (
        ORDER BY sum(pairs), low, high ROWS UNBOUNDED PRECEDING) AS so_far
    FROM matched
    GROUP BY low, high
),
paired AS (
    SELECT r.low, r.high, r.alike, m.unit_a, m.unit_b,
        unnest(c.circles[1:(array_length(c.circles, 1) / 2)]) AS circle_a,
        unnest(c.circles[(array_length(c.circles, 1) / 2 + 1):(array_length(c.circles, 1))]) AS circle_b
    FROM ranked AS r
    JOIN matched AS m ON m.low = r.low AND m.high = r.high
    JOIN circle_relation AS c ON c.object_id = :object_id AND c.class_no = m.class_no
    WHERE r.so_far <= :most
),
joined AS (
    SELECT unit_a, unit_b, circle_a, circle_b, alike,
        row_number() OVER (PARTITION BY low, high ORDER BY circle_a, circle_b, unit_a) AS place,
        count(*) OVER (PARTITION BY low, high) AS kept
    FROM paired
)
SELECT unit_a, unit_b, circle_a, circle_b, alike
FROM joined
WHERE kept <= :most_of_relation
    OR floor(place * CAST(:most_of_relation AS DOUBLE PRECISION) / kept)
        > floor((place - 1) * CAST(:most_of_relation AS DOUBLE PRECISION) / kept)
ORDER BY alike, unit_a, unit_b, circle_a, circle_b
