-- Image arcs beside arcs of a view: each element of an image arc with the nearest point of each arc of the view.
-- Takes extraction_id, run_id, view_no, reach (px between an element and a point) and max_along (px of it along the
-- arc);
-- gives image_arc_no, view_arc_no, elements (how many lie beside), of_elements (how many the image arc has), residual
-- (rms distance across, px), across (its mean, to the left of the view arc), angle (mean, rad), sigma (mean of the
-- points, px), first_point and last_point (of the view arc, the stretch that is covered).
WITH element AS (
    SELECT
        e.image_arc_no, e.edge_element_no,
        CAST(e.x AS DOUBLE PRECISION) AS x, CAST(e.y AS DOUBLE PRECISION) AS y,
        CAST(e.normal_x AS DOUBLE PRECISION) AS normal_x, CAST(e.normal_y AS DOUBLE PRECISION) AS normal_y,
        CAST(floor(e.x / :reach) AS INTEGER) AS cell_x, CAST(floor(e.y / :reach) AS INTEGER) AS cell_y
    FROM edge_element AS e
    WHERE e.extraction_id = :extraction_id AND e.image_arc_no IS NOT NULL
),
step AS (
    SELECT -1 AS by UNION ALL SELECT 0 UNION ALL SELECT 1
),
point AS (
    SELECT
        p.view_arc_no, p.point_no,
        CAST(p.x AS DOUBLE PRECISION) AS x, CAST(p.y AS DOUBLE PRECISION) AS y,
        CAST(p.direction_x AS DOUBLE PRECISION) AS direction_x, CAST(p.direction_y AS DOUBLE PRECISION) AS direction_y,
        CAST(p.sigma AS DOUBLE PRECISION) AS sigma,
        CAST(floor(p.x / :reach) AS INTEGER) + across.by AS cell_x,
        CAST(floor(p.y / :reach) AS INTEGER) + down.by AS cell_y
    FROM view_point AS p
    CROSS JOIN step AS across
    CROSS JOIN step AS down
    WHERE p.run_id = :run_id AND p.view_no = :view_no
),
close AS (
    SELECT
        e.image_arc_no, e.edge_element_no, p.view_arc_no, p.point_no, p.sigma,
        (e.y - p.y) * p.direction_x - (e.x - p.x) * p.direction_y AS across,
        (e.x - p.x) * p.direction_x + (e.y - p.y) * p.direction_y AS along,
        abs(e.normal_x * p.direction_x + e.normal_y * p.direction_y) AS sine,
        row_number() OVER (
            PARTITION BY e.edge_element_no, p.view_arc_no
            ORDER BY (e.x - p.x) * (e.x - p.x) + (e.y - p.y) * (e.y - p.y), p.point_no
        ) AS place
    FROM element AS e
    JOIN point AS p ON p.cell_x = e.cell_x AND p.cell_y = e.cell_y
    WHERE (e.x - p.x) * (e.x - p.x) + (e.y - p.y) * (e.y - p.y) <= :reach * :reach
),
size AS (
    SELECT image_arc_no, count(*) AS elements FROM element GROUP BY image_arc_no
)
-- Sums of whole numbers are the same in any order.
SELECT
    c.image_arc_no, c.view_arc_no, count(*) AS elements, max(s.elements) AS of_elements,
    sqrt(sum(CAST(round(c.across * c.across * 1e6) AS BIGINT)) / 1e6 / count(*)) AS residual,
    sum(CAST(round(c.across * 1e6) AS BIGINT)) / 1e6 / count(*) AS across,
    sum(CAST(round(asin(least(c.sine, 1.0)) * 1e6) AS BIGINT)) / 1e6 / count(*) AS angle,
    sum(CAST(round(c.sigma * 1e6) AS BIGINT)) / 1e6 / count(*) AS sigma,
    min(c.point_no) AS first_point, max(c.point_no) AS last_point
FROM close AS c
JOIN size AS s ON s.image_arc_no = c.image_arc_no
WHERE c.place = 1 AND abs(c.along) < :max_along
GROUP BY c.image_arc_no, c.view_arc_no
ORDER BY c.image_arc_no, c.view_arc_no
