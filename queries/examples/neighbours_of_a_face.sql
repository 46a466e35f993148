-- Which faces meet face 0, along how many edges, and how?
WITH body AS (
    SELECT shape_id
    FROM placed_part
    WHERE object = 'bulkhead' /* object */ AND variant = 'A' /* variant */ AND object_path = 'BODY' /* part */
)
SELECT CASE WHEN j.surface_a = 0 /* face */ THEN j.surface_b ELSE j.surface_a END AS neighbour, j.convexity, count(*) AS edges
FROM body
JOIN surface_adjacency AS j ON j.shape_id = body.shape_id AND (j.surface_a = 0 /* face */ OR j.surface_b = 0 /* face */)
GROUP BY CASE WHEN j.surface_a = 0 /* face */ THEN j.surface_b ELSE j.surface_a END, j.convexity
ORDER BY neighbour, j.convexity
