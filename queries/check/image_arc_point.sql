-- Courses of image arcs that are not there or not free, whose points are not numbered one by one from 0, and free arcs
-- without a course.
-- Takes nothing; gives extraction_id, image_arc_no and how many points.
SELECT coalesce(p.extraction_id, a.extraction_id) AS extraction_id, coalesce(p.image_arc_no, a.image_arc_no) AS image_arc_no,
    count(p.point_no) AS points
FROM image_arc_point AS p
FULL JOIN (
    SELECT DISTINCT extraction_id, image_arc_no FROM image_arc WHERE kind = 'free'
) AS a ON a.extraction_id = p.extraction_id AND a.image_arc_no = p.image_arc_no
GROUP BY coalesce(p.extraction_id, a.extraction_id), coalesce(p.image_arc_no, a.image_arc_no)
HAVING count(a.image_arc_no) < count(*) OR count(p.point_no) < count(*) OR min(p.point_no) < 0
    OR max(p.point_no) >= count(*) OR count(DISTINCT p.point_no) < count(*)
ORDER BY extraction_id, image_arc_no
