-- The cameras of an inspection, and how many image arcs each has.
-- Takes run; gives camera and arcs.
SELECT i.camera, count(a.image_arc_no) AS arcs
FROM inspection_image AS i
LEFT JOIN image_arc AS a ON a.extraction_id = i.extraction_id
WHERE i.run_id = :run
GROUP BY i.camera
ORDER BY i.camera
