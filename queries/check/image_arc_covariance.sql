-- Covariances of image arcs that are not there, or given twice.
-- Takes nothing; gives extraction_id, arc_no and how many such rows.
SELECT c.extraction_id, c.arc_no, count(*) AS covariances
FROM image_arc_covariance AS c
LEFT JOIN image_arc AS a ON a.extraction_id = c.extraction_id AND a.arc_no = c.arc_no
GROUP BY c.extraction_id, c.arc_no
HAVING count(*) > 1 OR count(a.arc_no) < count(*)
ORDER BY c.extraction_id, c.arc_no
