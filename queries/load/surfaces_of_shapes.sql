-- Surfaces that shapes list, by content.
-- Takes shape_ids (array).  Gives shape_id, surface_no and content_key, in order.
SELECT u.shape_id, u.surface_no, s.content_key
FROM shape_surface AS u
JOIN surface AS s ON s.id = u.surface_id
WHERE u.shape_id = ANY(:shape_ids)
ORDER BY u.shape_id, u.surface_no
