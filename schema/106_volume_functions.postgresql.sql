-- The functions that a person calls: a paragraph that begins with levels and volumes stands for one of each of these.

-- each of part, feature, surface, arc; box, boxes, sphere, view, volumes:
CREATE FUNCTION {level}s_in_{volume}({types}, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    {asked_column}world TEXT, occurrence_id BIGINT, path TEXT, {column}name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT {asked}world, occurrence_id, path, {number}name, x0, y0, z0, x1, y1, z1
FROM all_in_{volume}('{level}', {arguments}, in_world)
$$;
COMMENT ON FUNCTION {level}s_in_{volume} IS
    '{given} {where}; newest revision of all worlds or one.';

-- each of part, feature; box:
CREATE FUNCTION {level}s_within_{volume}({types}, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    world TEXT, occurrence_id BIGINT, path TEXT, {column}name TEXT,
    x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION, x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT o.*
FROM {level}s_in_{volume}({arguments}, in_world) AS o
WHERE o.x0 >= from_x AND o.y0 >= from_y AND o.z0 >= from_z AND o.x1 <= to_x AND o.y1 <= to_y AND o.z1 <= to_z
$$;
COMMENT ON FUNCTION {level}s_within_{volume} IS
    '{given} whose world box lies wholly in a box; newest revision of all worlds or one.';

-- each of part, feature; point:
CREATE FUNCTION nearest_{level}s({types}, in_world TEXT DEFAULT NULL) RETURNS TABLE (
    world TEXT, occurrence_id BIGINT, path TEXT, {column}name TEXT, x0 DOUBLE PRECISION, y0 DOUBLE PRECISION, z0 DOUBLE PRECISION,
    x1 DOUBLE PRECISION, y1 DOUBLE PRECISION, z1 DOUBLE PRECISION, distance_mm DOUBLE PRECISION
) LANGUAGE sql STABLE AS $$
SELECT world, occurrence_id, path, {number}name, x0, y0, z0, x1, y1, z1, distance_mm
FROM all_nearest('{level}', {arguments}, in_world)
$$;
COMMENT ON FUNCTION nearest_{level}s IS
    'The {nearest} are nearest to a point, so many, and how far these are, mm; newest revision of all worlds or one.';
