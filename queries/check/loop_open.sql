-- Loops that do not close: a coedge ends further from where the next one starts than its tolerance.
-- Takes nothing; gives surface_id, loop_no, coedge_no and the gap, mm.
WITH course AS (
    SELECT
        c.surface_id, c.loop_no, c.coedge_no, c.tolerance,
        CASE WHEN c.reversed THEN a.end_x ELSE a.start_x END AS from_x,
        CASE WHEN c.reversed THEN a.end_y ELSE a.start_y END AS from_y,
        CASE WHEN c.reversed THEN a.end_z ELSE a.start_z END AS from_z,
        CASE WHEN c.reversed THEN a.start_x ELSE a.end_x END AS to_x,
        CASE WHEN c.reversed THEN a.start_y ELSE a.end_y END AS to_y,
        CASE WHEN c.reversed THEN a.start_z ELSE a.end_z END AS to_z
    FROM coedge AS c
    JOIN arc AS a ON a.id = c.arc_id
),
followed AS (
    SELECT
        *,
        lead(from_x, 1, first_x) OVER following AS next_x,
        lead(from_y, 1, first_y) OVER following AS next_y,
        lead(from_z, 1, first_z) OVER following AS next_z
    FROM (
        SELECT
            *,
            first_value(from_x) OVER loops AS first_x,
            first_value(from_y) OVER loops AS first_y,
            first_value(from_z) OVER loops AS first_z
        FROM course
        WINDOW loops AS (PARTITION BY surface_id, loop_no ORDER BY coedge_no)
    ) AS begun
    WINDOW following AS (PARTITION BY surface_id, loop_no ORDER BY coedge_no)
),
gaps AS (
    SELECT
        surface_id, loop_no, coedge_no, tolerance,
        sqrt((next_x - to_x) * (next_x - to_x) + (next_y - to_y) * (next_y - to_y)
            + (next_z - to_z) * (next_z - to_z)) AS gap
    FROM followed
)
SELECT surface_id, loop_no, coedge_no, gap
FROM gaps
WHERE gap > tolerance
ORDER BY surface_id, loop_no, coedge_no
