-- Which faces of bulkhead meet its face 0, along how many edges, and how?
SELECT CASE WHEN j.surface_a = 0 /* face */ THEN j.surface_b ELSE j.surface_a END AS neighbour, j.convexity, count(*) AS edges
FROM placed_part AS p
JOIN surface_adjacency AS j ON j.shape_id = p.shape_id AND (j.surface_a = 0 /* face */ OR j.surface_b = 0 /* face */)
WHERE p.object = 'bulkhead' /* object */ AND p.variant = 'A' /* variant */ AND p.object_path = 'BODY' /* part */
GROUP BY CASE WHEN j.surface_a = 0 /* face */ THEN j.surface_b ELSE j.surface_a END, j.convexity
ORDER BY neighbour, j.convexity
