-- What it was compared with of the model, the pair that was taken first.
-- Takes run, camera and arc; gives sentence.
SELECT sentence
FROM why_arc
WHERE run_id = :run AND camera = :camera AND image_arc_no = :arc
ORDER BY CASE WHEN taken THEN 0 ELSE 1 END, value, view_arc_no
