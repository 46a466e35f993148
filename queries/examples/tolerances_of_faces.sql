-- Which dimensions, tolerances and datums does the file state of which faces of the parts of the bulkhead?
SELECT v.variant, v.revision, p.number, t.surface_no, t.kind, t.type, t.value, t.lower_limit, t.upper_limit, t.unit, t.datums
FROM object_variant AS v
JOIN placed_part AS p ON p.object_id = v.object_id
JOIN surface_pmi AS t ON t.part_id = p.part_id
WHERE v.name = 'bulkhead' /* object */
ORDER BY v.variant, v.revision, p.number, t.surface_no, t.pmi_no
