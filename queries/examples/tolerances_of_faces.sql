-- Which dimensions, tolerances and datums does the file state of which faces of the parts of bulkhead?
SELECT DISTINCT p.variant, p.revision, p.number, t.surface_no, t.pmi_no, t.kind, t.type, t.value, t.lower_limit, t.upper_limit,
    t.unit, t.datums
FROM placed_part AS p
JOIN surface_pmi AS t ON t.part_id = p.part_id
WHERE p.object = 'bulkhead' /* object */
ORDER BY p.variant, p.number, t.surface_no, t.pmi_no
