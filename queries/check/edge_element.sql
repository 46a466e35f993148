-- Edge elements of no extraction, or of an image arc that it lacks.
-- Takes nothing; gives extraction_id, arc_no and how many elements.
SELECT e.extraction_id, e.arc_no, count(*) AS elements
FROM edge_element AS e
LEFT JOIN extraction AS x ON x.id = e.extraction_id
LEFT JOIN image_arc AS a ON a.extraction_id = e.extraction_id AND a.arc_no = e.arc_no
WHERE x.id IS NULL OR (e.arc_no >= 0 AND a.arc_no IS NULL)
GROUP BY e.extraction_id, e.arc_no
ORDER BY e.extraction_id, e.arc_no
