-- The cameras of a rig.
-- Takes rig_id; gives camera, rig_from_camera as m00 .. m23, its sigmas, width, height, fx, fy, cx, cy, skew and
-- distortion, by camera.
SELECT k.name AS camera, k.m00, k.m01, k.m02, k.m03, k.m10, k.m11, k.m12, k.m13, k.m20, k.m21, k.m22, k.m23,
    k.sigma_focal, k.sigma_centre_px, k.sigma_translation_mm, k.sigma_rotation, k.sigma_radial,
    c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.skew, c.distortion
FROM rig_camera AS k
JOIN camera AS c ON c.id = k.camera_id
WHERE k.rig_id = :rig_id
ORDER BY k.name
