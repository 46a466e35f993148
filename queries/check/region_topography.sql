-- Topographic labels of regions that are not there, or counted twice.
-- Takes nothing; gives extraction_id, region_no, label and how many such rows.
SELECT t.extraction_id, t.region_no, t.label, count(*) AS counts
FROM region_topography AS t
LEFT JOIN image_region AS r ON r.extraction_id = t.extraction_id AND r.region_no = t.region_no
GROUP BY t.extraction_id, t.region_no, t.label
HAVING count(*) > 1 OR count(r.region_no) < count(*)
ORDER BY t.extraction_id, t.region_no, t.label
