-- What the functions that a person may call take: neither engine keeps a comment on an argument, nor DuckDB its type.

CREATE VIEW sds_argument (  -- catalogue: What each function that may be called in SQL takes, in its order.
    function_name,  -- the function, which gives rows: SELECT * FROM parts_in_sphere(0, 0, 0, 100)
    argument_no,  -- ordinal of the argument in it, from 1
    argument,  -- name of the argument
    type,  -- its type
    comment  -- what it means, with its unit
) AS
SELECT concat(l.start, coalesce(l.ending, a.volume)) AS function_name, a.argument_no, a.argument, a.type, a.comment
FROM (VALUES
    ('parts_in_', NULL, NULL), ('features_in_', NULL, NULL), ('surfaces_in_', NULL, NULL), ('arcs_in_', NULL, NULL),
    ('parts_within_', 'box', 'box'), ('features_within_', 'box', 'box'),
    ('nearest_', 'parts', 'point'), ('nearest_', 'features', 'point')
) AS l (start, ending, only_volume)
JOIN (VALUES
    ('box', 1, 'from_x', 'DOUBLE PRECISION', 'least x of the box, mm, in the world''s frame'),
    ('box', 2, 'from_y', 'DOUBLE PRECISION', 'least y of the box, mm'),
    ('box', 3, 'from_z', 'DOUBLE PRECISION', 'least z of the box, mm'),
    ('box', 4, 'to_x', 'DOUBLE PRECISION', 'greatest x of the box, mm'),
    ('box', 5, 'to_y', 'DOUBLE PRECISION', 'greatest y of the box, mm'),
    ('box', 6, 'to_z', 'DOUBLE PRECISION', 'greatest z of the box, mm'),
    ('box', 7, 'in_world', 'TEXT', 'name of the world; may be left out: all worlds'),
    ('boxes', 1, 'asked', 'TEXT', 'name of a table or view of volume_no and the box x0 .. z1, mm, in the world''s frame'),
    ('boxes', 2, 'in_world', 'TEXT', 'name of the world; may be left out: all worlds'),
    ('point', 1, 'at_x', 'DOUBLE PRECISION', 'x of the point, mm, in the world''s frame'),
    ('point', 2, 'at_y', 'DOUBLE PRECISION', 'y of the point, mm'),
    ('point', 3, 'at_z', 'DOUBLE PRECISION', 'z of the point, mm'),
    ('point', 4, 'how_many', 'BIGINT', 'how many, at least 0'),
    ('point', 5, 'in_world', 'TEXT', 'name of the world; may be left out: all worlds'),
    ('volumes', 1, 'asked', 'TEXT', 'the same, with ball_x .. ball_z and ball_radius, and half_spaces (nx, ny, nz, d of each after the other), or null'),
    ('volumes', 2, 'in_world', 'TEXT', 'name of the world; may be left out: all worlds'),
    ('sphere', 1, 'at_x', 'DOUBLE PRECISION', 'x of the ball''s centre, mm, in the world''s frame'),
    ('sphere', 2, 'at_y', 'DOUBLE PRECISION', 'y of the ball''s centre, mm'),
    ('sphere', 3, 'at_z', 'DOUBLE PRECISION', 'z of the ball''s centre, mm'),
    ('sphere', 4, 'radius', 'DOUBLE PRECISION', 'radius of the ball, mm, at least 0'),
    ('sphere', 5, 'in_world', 'TEXT', 'name of the world; may be left out: all worlds'),
    ('view', 1, 'in_camera', 'BIGINT', 'the camera, as camera.id: rig_camera has those of a rig by name'),
    ('view', 2, 'c00', 'DOUBLE PRECISION', 'world_from_camera (x right, y down, z forward): row 0, column 0 of the rotation'),
    ('view', 3, 'c01', 'DOUBLE PRECISION', 'world_from_camera: row 0, column 1 of the rotation'),
    ('view', 4, 'c02', 'DOUBLE PRECISION', 'world_from_camera: row 0, column 2 of the rotation'),
    ('view', 5, 'c03', 'DOUBLE PRECISION', 'world_from_camera: row 0 of the translation, mm'),
    ('view', 6, 'c10', 'DOUBLE PRECISION', 'world_from_camera: row 1, column 0 of the rotation'),
    ('view', 7, 'c11', 'DOUBLE PRECISION', 'world_from_camera: row 1, column 1 of the rotation'),
    ('view', 8, 'c12', 'DOUBLE PRECISION', 'world_from_camera: row 1, column 2 of the rotation'),
    ('view', 9, 'c13', 'DOUBLE PRECISION', 'world_from_camera: row 1 of the translation, mm'),
    ('view', 10, 'c20', 'DOUBLE PRECISION', 'world_from_camera: row 2, column 0 of the rotation'),
    ('view', 11, 'c21', 'DOUBLE PRECISION', 'world_from_camera: row 2, column 1 of the rotation'),
    ('view', 12, 'c22', 'DOUBLE PRECISION', 'world_from_camera: row 2, column 2 of the rotation'),
    ('view', 13, 'c23', 'DOUBLE PRECISION', 'world_from_camera: row 2 of the translation, mm'),
    ('view', 14, 'near', 'DOUBLE PRECISION', 'depth along z of the camera at which the view begins, mm, at least 0'),
    ('view', 15, 'far', 'DOUBLE PRECISION', 'depth at which it ends, mm, more than near'),
    ('view', 16, 'in_world', 'TEXT', 'name of the world; may be left out: all worlds')
) AS a (volume, argument_no, argument, type, comment) ON a.volume = coalesce(l.only_volume, a.volume)
    AND (a.volume <> 'point' OR l.start = 'nearest_');
