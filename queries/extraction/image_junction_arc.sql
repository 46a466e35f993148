-- Which arcs of an extraction meet in which junctions.
-- Takes extraction_id; gives junction_no, image_arc_no, meets_with.
SELECT junction_no,
    image_arc_no,
    meets_with
FROM image_junction_arc
WHERE extraction_id = :extraction_id
ORDER BY junction_no, image_arc_no, meets_with
