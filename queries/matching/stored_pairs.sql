-- Pairs of arcs of a picture and of a view that were considered at the best hypothesis of a run, and of those that
-- became candidates how far they are off.
-- Takes run_id, view_no, problem_no; gives image_arc, view_arc, reason, residual, gate, angle, angle_gate, overlap,
-- first_point, last_point, across, across_sigma, shift_1 to shift_6.
SELECT d.image_arc_no AS image_arc, d.view_arc_no AS view_arc, d.reason, d.residual, d.gate, d.angle, d.angle_gate,
    d.overlap, d.first_point, d.last_point, c.across, c.across_sigma,
    c.shift_1, c.shift_2, c.shift_3, c.shift_4, c.shift_5, c.shift_6
FROM correspondence AS d
LEFT JOIN candidate AS c ON c.run_id = d.run_id AND c.problem_no = :problem_no AND c.unit_no = d.image_arc_no
    AND c.label_no = d.view_arc_no
WHERE d.run_id = :run_id AND d.view_no = :view_no AND d.hypothesis_no = 0
ORDER BY d.image_arc_no, d.view_arc_no
