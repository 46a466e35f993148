-- The cameras of the rig of an inspection, where the rig has them.
-- Takes run_id; gives one row a camera that took a picture, in order of its name.
SELECT c.name AS camera, k.width, k.height, k.fx, k.fy, k.cx, k.cy, k.skew, k.distortion,
    c.m00, c.m01, c.m02, c.m03, c.m10, c.m11, c.m12, c.m13, c.m20, c.m21, c.m22, c.m23
FROM inspection AS i
JOIN inspection_image AS p ON p.run_id = i.run_id
JOIN rig_camera AS c ON c.rig_id = i.rig_id AND c.name = p.camera
JOIN camera AS k ON k.id = c.camera_id
WHERE i.run_id = :run_id
ORDER BY c.name
