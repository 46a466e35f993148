-- The image arc that is asked about.
-- Takes run, camera and arc; gives sentence.
SELECT concat('image arc ', a.image_arc_no, ' of the ', i.camera, ' picture is ', a.kind, ', ',
    CAST(a.length AS NUMERIC(18, 1)), ' px long, from (', CAST(a.start_x AS NUMERIC(18, 1)), ', ',
    CAST(a.start_y AS NUMERIC(18, 1)), ') to (', CAST(a.end_x AS NUMERIC(18, 1)), ', ',
    CAST(a.end_y AS NUMERIC(18, 1)), '), contrast ', CAST(a.contrast AS NUMERIC(18, 1))) AS sentence
FROM inspection_image AS i
JOIN image_arc AS a ON a.extraction_id = i.extraction_id
WHERE i.run_id = :run AND i.camera = :camera AND a.image_arc_no = :arc
