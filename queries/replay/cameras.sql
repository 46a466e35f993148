-- The cameras of an inspection, in the order of its views.
-- Takes run; gives view_no, camera, extraction_id, rig_from_camera as m00 .. m23, its sigmas, width, height, fx, fy,
-- cx, cy, skew and distortion.
SELECT v.view_no, v.camera, v.extraction_id, k.m00, k.m01, k.m02, k.m03, k.m10, k.m11, k.m12, k.m13, k.m20, k.m21, k.m22, k.m23,
    k.sigma_focal, k.sigma_centre_px, k.sigma_translation_mm, k.sigma_rotation,
    c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.skew, c.distortion
FROM inspection_image AS v
JOIN inspection AS i ON i.run_id = v.run_id
JOIN rig_camera AS k ON k.rig_id = i.rig_id AND k.name = v.camera
JOIN camera AS c ON c.id = k.camera_id
WHERE v.run_id = :run AND v.view_no IS NOT NULL
ORDER BY v.view_no
