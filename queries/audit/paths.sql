-- Paths of the parts and features that an inspection has in view.
-- Takes run; gives path.
SELECT path
FROM part_in_view
WHERE run_id = :run
ORDER BY in_view_no
