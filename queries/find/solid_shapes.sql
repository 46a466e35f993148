-- Which shapes are solid: a volume wholly inside one meets it though it meets no surface.
-- Takes shape_ids (array); gives shape_id, in order.
SELECT id AS shape_id
FROM shape
WHERE id = ANY(:shape_ids) AND kind = 'solid'
ORDER BY id
