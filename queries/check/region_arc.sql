-- Bounding arcs of regions where region or arc is not there, or that are given twice.
-- Takes nothing; gives extraction_id, region_no, image_arc_no, side and how many such rows.
SELECT b.extraction_id, b.region_no, b.image_arc_no, b.side, count(*) AS borders
FROM region_arc AS b
LEFT JOIN image_region AS r ON r.extraction_id = b.extraction_id AND r.region_no = b.region_no
LEFT JOIN image_arc AS a ON a.extraction_id = b.extraction_id AND a.image_arc_no = b.image_arc_no
GROUP BY b.extraction_id, b.region_no, b.image_arc_no, b.side
HAVING count(*) > 1 OR count(r.region_no) < count(*) OR count(a.image_arc_no) < count(*)
ORDER BY b.extraction_id, b.region_no, b.image_arc_no, b.side
