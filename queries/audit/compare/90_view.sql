-- What a run has in view.
-- Takes run; gives name (the path) and value (share that shows).
SELECT path AS name, CAST(CAST(visible_pixels / covered_pixels AS NUMERIC(18, 4)) AS TEXT) AS value
FROM part_in_view
WHERE run_id = :run
