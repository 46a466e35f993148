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
        coalesce(lead(from_x) OVER loops, first_value(from_x) OVER loops) AS next_x,
        coalesce(lead(from_y) OVER loops, first_value(from_y) OVER loops) AS next_y,
        coalesce(lead(from_z) OVER loops, first_value(from_z) OVER loops) AS next_z
    FROM course
    WINDOW loops AS (PARTITION BY surface_id, loop_no ORDER BY coedge_no)
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
