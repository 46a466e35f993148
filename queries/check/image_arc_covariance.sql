-- Covariances of image arcs that are not there, or given twice.
-- Takes nothing; gives extraction_id, image_arc_no and how many such rows.
SELECT c.extraction_id, c.image_arc_no, count(*) AS covariances
FROM image_arc_covariance AS c
LEFT JOIN image_arc AS a ON a.extraction_id = c.extraction_id AND a.image_arc_no = c.image_arc_no
GROUP BY c.extraction_id, c.image_arc_no
HAVING count(*) > 1 OR count(a.image_arc_no) < count(*)
ORDER BY c.extraction_id, c.image_arc_no
