-- Edge elements of no extraction, of an image arc that it lacks, or not numbered one by one from 0.
-- Takes nothing; gives extraction_id, and how many elements it has.
SELECT e.extraction_id, count(*) AS elements
FROM edge_element AS e
LEFT JOIN extraction AS x ON x.id = e.extraction_id
LEFT JOIN (
    SELECT DISTINCT extraction_id, image_arc_no FROM image_arc
) AS a ON a.extraction_id = e.extraction_id AND a.image_arc_no = e.image_arc_no
GROUP BY e.extraction_id
HAVING count(x.id) < count(*) OR count(CASE WHEN e.image_arc_no IS NOT NULL AND a.image_arc_no IS NULL THEN 1 END) > 0
    OR min(e.edge_element_no) < 0 OR max(e.edge_element_no) >= count(*) OR count(DISTINCT e.edge_element_no) < count(*)
ORDER BY e.extraction_id
