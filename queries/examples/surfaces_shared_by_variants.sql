-- How many surfaces do the bodies of variants A and B share?
WITH listed AS (
    SELECT p.variant, h.surface_id
    FROM placed_part AS p
    JOIN shape_surface AS h ON h.shape_id = p.shape_id
    WHERE p.object = 'bulkhead' /* object */ AND p.object_path = 'BODY' /* part */
)
SELECT count(DISTINCT a.surface_id) AS shared
FROM listed AS a
JOIN listed AS b ON b.surface_id = a.surface_id
WHERE a.variant = 'A' /* one */ AND b.variant = 'B' /* other */
