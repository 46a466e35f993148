-- Arcs in a junction where arc or junction is not there, or that take part in it twice.
-- Takes nothing; gives extraction_id, junction_no, image_arc_no and how many such rows.
SELECT m.extraction_id, m.junction_no, m.image_arc_no, count(*) AS meetings
FROM image_junction_arc AS m
LEFT JOIN image_junction AS j ON j.extraction_id = m.extraction_id AND j.junction_no = m.junction_no
LEFT JOIN image_arc AS a ON a.extraction_id = m.extraction_id AND a.image_arc_no = m.image_arc_no
GROUP BY m.extraction_id, m.junction_no, m.image_arc_no
HAVING count(*) > 1 OR count(j.junction_no) < count(*) OR count(a.image_arc_no) < count(*)
ORDER BY m.extraction_id, m.junction_no, m.image_arc_no
