-- Arcs and regions of extractions that are not there, and units of sets that are not, or not numbered one by one from
-- 0.
-- Takes nothing; gives relation, identity of the extraction or set, and how many rows.
SELECT 'image_arc' AS relation, a.extraction_id AS id, count(*) AS primitives
FROM image_arc AS a
LEFT JOIN extraction AS e ON e.id = a.extraction_id
GROUP BY a.extraction_id
HAVING count(e.id) < count(*) OR min(a.image_arc_no) < 0 OR max(a.image_arc_no) >= count(*) OR count(DISTINCT a.image_arc_no) < count(*)
UNION ALL
SELECT 'image_region', r.extraction_id, count(*)
FROM image_region AS r
LEFT JOIN extraction AS e ON e.id = r.extraction_id
GROUP BY r.extraction_id
HAVING count(e.id) < count(*) OR min(r.region_no) < 0 OR max(r.region_no) >= count(*) OR count(DISTINCT r.region_no) < count(*)
UNION ALL
SELECT 'unit', u.unit_set_id, count(*)
FROM unit AS u
LEFT JOIN unit_set AS s ON s.id = u.unit_set_id
GROUP BY u.unit_set_id
HAVING count(s.id) < count(*) OR min(u.unit_no) < 0 OR max(u.unit_no) >= count(*) OR count(DISTINCT u.unit_no) < count(*)
ORDER BY relation, id
