-- How many surfaces do the bodies of variants A and B share?
WITH listed AS (
    SELECT v.variant, h.surface_id
    FROM object_variant AS v
    JOIN object_part AS i ON i.object_id = v.object_id AND i.name = 'BODY' /* part */
    JOIN part AS p ON p.id = i.part_id
    JOIN shape_surface AS h ON h.shape_id = p.shape_id
    WHERE v.name = 'bulkhead' /* object */
)
SELECT count(DISTINCT a.surface_id) AS shared
FROM listed AS a
JOIN listed AS b ON b.surface_id = a.surface_id
WHERE a.variant = 'A' /* one */ AND b.variant = 'B' /* other */
