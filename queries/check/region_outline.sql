-- Outlines of image regions that are not there, or whose corners are not numbered one by one from 0.
-- Takes nothing; gives extraction_id, region_no, ring_no and how many corners.
SELECT o.extraction_id, o.region_no, o.ring_no, count(*) AS corners
FROM region_outline AS o
LEFT JOIN image_region AS r ON r.extraction_id = o.extraction_id AND r.region_no = o.region_no
GROUP BY o.extraction_id, o.region_no, o.ring_no
HAVING count(r.region_no) < count(*) OR min(o.point_no) < 0 OR max(o.point_no) >= count(*)
    OR count(DISTINCT o.point_no) < count(*)
ORDER BY o.extraction_id, o.region_no, o.ring_no
