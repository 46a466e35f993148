-- Surfaces that shapes list, by content.
-- Takes the relation sought (id); gives shape_id, surface_no and content_key, in order.
SELECT u.shape_id, u.surface_no, s.content_key
FROM sought
JOIN shape_surface AS u ON u.shape_id = sought.id
JOIN surface AS s ON s.id = u.surface_id
ORDER BY u.shape_id, u.surface_no
