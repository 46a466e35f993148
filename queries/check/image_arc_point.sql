-- Courses of image arcs that are not there, or whose points are not numbered one by one from 0.
-- Takes nothing; gives extraction_id, arc_no and how many points.
SELECT p.extraction_id, p.arc_no, count(*) AS points
FROM image_arc_point AS p
LEFT JOIN image_arc AS a ON a.extraction_id = p.extraction_id AND a.arc_no = p.arc_no
GROUP BY p.extraction_id, p.arc_no
HAVING count(a.arc_no) < count(*) OR min(p.point_no) < 0 OR max(p.point_no) >= count(*)
    OR count(DISTINCT p.point_no) < count(*)
ORDER BY p.extraction_id, p.arc_no
