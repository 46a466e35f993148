-- Which faces meet face 0, along how many edges, and how?
WITH body AS (
    SELECT p.shape_id
    FROM object_variant AS v
    JOIN object_part AS i ON i.object_id = v.object_id
    JOIN part AS p ON p.id = i.part_id
    WHERE v.name = 'bulkhead' /* object */ AND v.variant = 'A' /* variant */ AND i.name = 'BODY' /* part */
    ORDER BY v.revision DESC
    LIMIT 1
)
SELECT CASE WHEN j.surface_a = 0 /* face */ THEN j.surface_b ELSE j.surface_a END AS neighbour, j.convexity, count(*) AS edges
FROM body
JOIN surface_adjacency AS j ON j.shape_id = body.shape_id AND (j.surface_a = 0 /* face */ OR j.surface_b = 0 /* face */)
GROUP BY CASE WHEN j.surface_a = 0 /* face */ THEN j.surface_b ELSE j.surface_a END, j.convexity
ORDER BY neighbour, j.convexity
