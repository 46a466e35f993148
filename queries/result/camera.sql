-- The cameras that took the pictures of an inspection, and the pictures.
-- Takes run_id; gives per camera its picture, calibration (pixels, OpenCV's distortion) and rig_from_camera as m00 ..
-- m23.
SELECT
    i.camera, p.file_name, p.sha256, c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.skew, c.distortion,
    k.m00, k.m01, k.m02, k.m03, k.m10, k.m11, k.m12, k.m13, k.m20, k.m21, k.m22, k.m23
FROM inspection_image AS i
JOIN image AS p ON p.id = i.image_id
JOIN inspection AS n ON n.run_id = i.run_id
JOIN rig_camera AS k ON k.rig_id = n.rig_id AND k.name = i.camera
JOIN camera AS c ON c.id = k.camera_id
WHERE i.run_id = :run_id
ORDER BY i.camera_no
