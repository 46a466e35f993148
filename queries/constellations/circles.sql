-- The circles of an object.
-- Takes object_id; gives circle_no, x, y, z (centre, mm), nx, ny, nz (unit normal of either sign), radius (mm), in the
-- frame of the circle's body.
SELECT circle_no, x, y, z, nx, ny, nz, radius
FROM circle
WHERE object_id = :object_id
ORDER BY circle_no
