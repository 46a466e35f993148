-- The functions that a person calls: a paragraph that begins with levels and volumes stands for one of each of these.

-- each of part, feature, surface, arc; box, boxes, sphere, view, volumes:
CREATE MACRO {level}s_in_{volume}({arguments}, in_world := NULL) AS TABLE
SELECT {asked}world, occurrence_id, path, {number}name, x0, y0, z0, x1, y1, z1
FROM all_in_{volume}('{level}', {arguments}, in_world);
COMMENT ON MACRO TABLE {level}s_in_{volume} IS
    '{given} {where}; newest revision of all worlds or one.';

-- This way of parts alone is planned twice as fast.
CREATE OR REPLACE MACRO parts_in_box(from_x, from_y, from_z, to_x, to_y, to_z, in_world := NULL) AS TABLE
SELECT world, occurrence_id, path, name, x0, y0, z0, x1, y1, z1
FROM all_about(
    [{volume_no: checked_box(from_x, from_y, from_z, to_x, to_y, to_z), x0: from_x, y0: from_y, z0: from_z, x1: to_x, y1: to_y, z1: to_z}],
    in_world
);
COMMENT ON MACRO TABLE parts_in_box IS
    'Placed parts whose world box meets a box; newest revision of all worlds or one.';

-- each of part, feature; box:
CREATE MACRO {level}s_within_{volume}({arguments}, in_world := NULL) AS TABLE
SELECT o.*
FROM {level}s_in_{volume}({arguments}, in_world) AS o
WHERE o.x0 >= from_x AND o.y0 >= from_y AND o.z0 >= from_z AND o.x1 <= to_x AND o.y1 <= to_y AND o.z1 <= to_z;
COMMENT ON MACRO TABLE {level}s_within_{volume} IS
    '{given} whose world box lies wholly in a box; newest revision of all worlds or one.';

-- each of part, feature; point:
CREATE MACRO nearest_{level}s({arguments}, in_world := NULL) AS TABLE
SELECT world, occurrence_id, path, {number}name, x0, y0, z0, x1, y1, z1, distance_mm
FROM all_nearest('{level}', {arguments}, in_world);
COMMENT ON MACRO TABLE nearest_{level}s IS
    'The {nearest} are nearest to a point, so many, and how far these are, mm; newest revision of all worlds or one.';
