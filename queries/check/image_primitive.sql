-- Arcs and regions of extractions that are not there, and units of sets that are not.
-- Takes nothing; gives relation, identity of the extraction or set, and how many rows.
SELECT 'image_arc' AS relation, a.extraction_id AS id, count(*) AS primitives
FROM image_arc AS a
LEFT JOIN extraction AS e ON e.id = a.extraction_id
WHERE e.id IS NULL
GROUP BY a.extraction_id
UNION ALL
SELECT 'image_region', r.extraction_id, count(*)
FROM image_region AS r
LEFT JOIN extraction AS e ON e.id = r.extraction_id
WHERE e.id IS NULL
GROUP BY r.extraction_id
UNION ALL
SELECT 'unit', u.unit_set_id, count(*)
FROM unit AS u
LEFT JOIN unit_set AS s ON s.id = u.unit_set_id
WHERE s.id IS NULL
GROUP BY u.unit_set_id
ORDER BY relation, id
