-- The sets of units of the views of an inspection.
-- Takes run; gives id, in the order of the views.
SELECT id FROM unit_set WHERE run_id = :run ORDER BY view_no
