-- Which arcs bound which regions of an extraction.
-- Takes extraction_id; gives region_no, image_arc_no, side, length.
SELECT region_no,
    image_arc_no,
    side,
    CAST(length AS DOUBLE PRECISION) AS length
FROM region_arc
WHERE extraction_id = :extraction_id
ORDER BY region_no, image_arc_no, side
