-- Arcs of junctions where junction or arc is not there, or that are given twice.
-- Takes nothing; gives extraction_id, junction_no, arc_no, meets_with and how many such rows.
SELECT m.extraction_id, m.junction_no, m.arc_no, m.meets_with, count(*) AS meetings
FROM image_junction_arc AS m
LEFT JOIN image_junction AS j ON j.extraction_id = m.extraction_id AND j.junction_no = m.junction_no
LEFT JOIN image_arc AS a ON a.extraction_id = m.extraction_id AND a.arc_no = m.arc_no
GROUP BY m.extraction_id, m.junction_no, m.arc_no, m.meets_with
HAVING count(*) > 1 OR count(j.junction_no) < count(*) OR count(a.arc_no) < count(*)
ORDER BY m.extraction_id, m.junction_no, m.arc_no, m.meets_with
