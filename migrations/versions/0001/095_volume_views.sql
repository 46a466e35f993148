-- What volume queries read: the worlds as they are now, and the boxes of placed features, surfaces and arcs.

CREATE VIEW current_world AS
SELECT w.id, w.name, w.revision, w.content_key
FROM world AS w
WHERE NOT EXISTS (SELECT 1 FROM world AS later WHERE later.name = w.name AND later.revision > w.revision);
COMMENT ON VIEW current_world IS 'The newest revision of each world.';
COMMENT ON COLUMN current_world.id IS 'identity of this revision of the world';
COMMENT ON COLUMN current_world.name IS 'name of the world';
COMMENT ON COLUMN current_world.revision IS 'its newest revision';
COMMENT ON COLUMN current_world.content_key IS 'hash of all that the world file says';

CREATE VIEW placed_element AS
SELECT o.world_id, o.id AS occurrence_id, o.path, o.shape_id, e.level, e.element_no,
    least(o.m00 * e.x0, o.m00 * e.x1) + least(o.m01 * e.y0, o.m01 * e.y1)
        + least(o.m02 * e.z0, o.m02 * e.z1) + o.m03 AS x0,
    least(o.m10 * e.x0, o.m10 * e.x1) + least(o.m11 * e.y0, o.m11 * e.y1)
        + least(o.m12 * e.z0, o.m12 * e.z1) + o.m13 AS y0,
    least(o.m20 * e.x0, o.m20 * e.x1) + least(o.m21 * e.y0, o.m21 * e.y1)
        + least(o.m22 * e.z0, o.m22 * e.z1) + o.m23 AS z0,
    greatest(o.m00 * e.x0, o.m00 * e.x1) + greatest(o.m01 * e.y0, o.m01 * e.y1)
        + greatest(o.m02 * e.z0, o.m02 * e.z1) + o.m03 AS x1,
    greatest(o.m10 * e.x0, o.m10 * e.x1) + greatest(o.m11 * e.y0, o.m11 * e.y1)
        + greatest(o.m12 * e.z0, o.m12 * e.z1) + o.m13 AS y1,
    greatest(o.m20 * e.x0, o.m20 * e.x1) + greatest(o.m21 * e.y0, o.m21 * e.y1)
        + greatest(o.m22 * e.z0, o.m22 * e.z1) + o.m23 AS z1
FROM occurrence AS o
JOIN shape_box AS e ON e.shape_id = o.shape_id;
COMMENT ON VIEW placed_element IS 'Features, surfaces and arcs of placed parts; the box is theirs in the shape''s frame, carried.';
COMMENT ON COLUMN placed_element.world_id IS 'the world';
COMMENT ON COLUMN placed_element.occurrence_id IS 'the placed part';
COMMENT ON COLUMN placed_element.path IS 'path of the placed part';
COMMENT ON COLUMN placed_element.shape_id IS 'the part''s geometry';
COMMENT ON COLUMN placed_element.level IS 'feature, surface or arc';
COMMENT ON COLUMN placed_element.element_no IS 'feature_no, surface_no or arc_no in the shape';
COMMENT ON COLUMN placed_element.x0 IS 'least x of the carried box in the world, mm';
COMMENT ON COLUMN placed_element.y0 IS 'least y of the carried box in the world, mm';
COMMENT ON COLUMN placed_element.z0 IS 'least z of the carried box in the world, mm';
COMMENT ON COLUMN placed_element.x1 IS 'greatest x of the carried box in the world, mm';
COMMENT ON COLUMN placed_element.y1 IS 'greatest y of the carried box in the world, mm';
COMMENT ON COLUMN placed_element.z1 IS 'greatest z of the carried box in the world, mm';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('current_world', 'world', 'view'),
    ('placed_element', 'world', 'view');
