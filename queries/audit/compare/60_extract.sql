-- What a run found in its pictures.
-- Takes run; gives name and value.
SELECT concat(i.camera, ' extraction') AS name, e.content_key AS value
FROM inspection_image AS i
JOIN extraction AS e ON e.id = i.extraction_id
WHERE i.run_id = :run
UNION ALL
SELECT concat(i.camera, ' arcs'), CAST(count(*) AS TEXT)
FROM inspection_image AS i
JOIN image_arc AS a ON a.extraction_id = i.extraction_id
WHERE i.run_id = :run
GROUP BY i.camera
