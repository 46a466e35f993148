-- Quality values of image arcs that are not there, or given twice.
-- Takes nothing; gives extraction_id, image_arc_no, name and how many such values.
SELECT m.extraction_id, m.image_arc_no, m.name, count(*) AS rows_found
FROM image_arc_quality AS m
LEFT JOIN image_arc AS a ON a.extraction_id = m.extraction_id AND a.image_arc_no = m.image_arc_no
GROUP BY m.extraction_id, m.image_arc_no, m.name
HAVING count(*) > 1 OR count(a.image_arc_no) < count(*)
ORDER BY m.extraction_id, m.image_arc_no, m.name
