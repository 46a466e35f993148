-- Attributes of objects, of parts, and of the surfaces and arcs of parts, the newest value of each; of parts also how
-- many dimensions, tolerances and datums they have.
-- Takes object_ids and part_ids (arrays); gives level, id (of the object or part), name, value as text, unit; of
-- surfaces and arcs also elements: the ordinals that have the value, or how many where more than five; sorted.
WITH element AS (
    SELECT 'surface' AS level, shape_id, surface_no AS element_no, name, value_number, value_text, value_boolean, unit
    FROM current_surface_attribute
    UNION ALL
    SELECT 'arc', shape_id, arc_no, name, value_number, value_text, value_boolean, unit
    FROM current_arc_attribute
),
stated AS (
    SELECT 'object' AS level, object_id AS id, name, value_number, value_text, value_boolean, unit,
        CAST(NULL AS INTEGER) AS element_no
    FROM current_object_attribute
    WHERE object_id = ANY(:object_ids)
    UNION ALL
    SELECT 'part', part_id, name, value_number, value_text, value_boolean, unit, NULL
    FROM current_part_attribute
    WHERE part_id = ANY(:part_ids)
    UNION ALL
    SELECT e.level, p.id, e.name, e.value_number, e.value_text, e.value_boolean, e.unit, e.element_no
    FROM part AS p
    JOIN element AS e ON e.shape_id = p.shape_id
    WHERE p.id = ANY(:part_ids)
)
SELECT level, id, name, coalesce(value_text, CAST(value_number AS TEXT), CAST(value_boolean AS TEXT)) AS value, unit,
    CASE WHEN count(element_no) > 5 THEN CAST(count(element_no) AS TEXT) || ' ' || level || 's'
        WHEN count(element_no) > 0 THEN level || ' ' || string_agg(CAST(element_no AS TEXT), ', ' ORDER BY element_no) END
        AS elements
FROM stated
GROUP BY level, id, name, value_number, value_text, value_boolean, unit
UNION ALL
SELECT 'part', part_id, kind || 's', CAST(count(*) AS TEXT), CAST(NULL AS TEXT), CAST(NULL AS TEXT)
FROM part_pmi
WHERE part_id = ANY(:part_ids)
GROUP BY part_id, kind
ORDER BY 1, 2, 3, 4
