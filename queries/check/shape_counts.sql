-- Shapes that do not list as many surfaces and arcs as they say.
-- Takes nothing; gives shape_id, what it says and what it lists.
SELECT s.id AS shape_id, s.surface_count, coalesce(f.listed, 0) AS surfaces_listed, s.arc_count, coalesce(a.listed, 0) AS arcs_listed
FROM shape AS s
LEFT JOIN (SELECT shape_id, count(*) AS listed FROM shape_surface GROUP BY shape_id) AS f ON f.shape_id = s.id
LEFT JOIN (SELECT shape_id, count(*) AS listed FROM shape_arc GROUP BY shape_id) AS a ON a.shape_id = s.id
WHERE s.surface_count <> coalesce(f.listed, 0) OR s.arc_count <> coalesce(a.listed, 0)
ORDER BY s.id
