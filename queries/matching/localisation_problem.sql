-- A localisation problem: whose units are matched against whose, and how many there are.
-- Takes run_id, problem_no; gives no row or one: units_id, labels_id, view_no, parameters, image_arcs, regions,
-- view_arcs, view_surfaces.
SELECT p.units_id, p.labels_id, l.view_no, p.parameters,
    (SELECT count(*) FROM unit AS u WHERE u.unit_set_id = p.units_id AND u.kind = 'arc') AS image_arcs,
    (SELECT count(*) FROM unit AS u WHERE u.unit_set_id = p.units_id AND u.kind = 'region') AS regions,
    (SELECT count(*) FROM unit AS u WHERE u.unit_set_id = p.labels_id AND u.kind = 'view_arc') AS view_arcs,
    (SELECT count(*) FROM unit AS u WHERE u.unit_set_id = p.labels_id AND u.kind = 'view_surface') AS view_surfaces
FROM problem AS p
JOIN unit_set AS l ON l.id = p.labels_id AND l.kind = 'view'
WHERE p.run_id = :run_id AND p.problem_no = :problem_no AND p.kind = 'localisation'
