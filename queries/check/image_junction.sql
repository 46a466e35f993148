-- Junctions of no extraction, that are given twice, or in which fewer than two arcs meet.
-- Takes nothing; gives extraction_id, junction_no and how many such rows.
SELECT j.extraction_id, j.junction_no, count(*) AS junctions
FROM image_junction AS j
LEFT JOIN extraction AS x ON x.id = j.extraction_id
LEFT JOIN (
    SELECT extraction_id, junction_no, count(*) AS arcs FROM image_junction_arc GROUP BY extraction_id, junction_no
) AS m ON m.extraction_id = j.extraction_id AND m.junction_no = j.junction_no
GROUP BY j.extraction_id, j.junction_no
HAVING count(*) > 1 OR count(x.id) = 0 OR coalesce(min(m.arcs), 0) < 2
ORDER BY j.extraction_id, j.junction_no
