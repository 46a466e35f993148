-- What speaks against arcs of an extraction.
-- Takes extraction_id; gives image_arc_no, name, value.
SELECT image_arc_no,
    name,
    CAST(value AS DOUBLE PRECISION) AS value
FROM image_arc_quality
WHERE extraction_id = :extraction_id
ORDER BY image_arc_no, name
