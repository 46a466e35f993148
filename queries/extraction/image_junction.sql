-- The junctions of an extraction.
-- Takes extraction_id; gives kind, x, y.
SELECT kind,
    CAST(x AS DOUBLE PRECISION) AS x,
    CAST(y AS DOUBLE PRECISION) AS y
FROM image_junction
WHERE extraction_id = :extraction_id
ORDER BY junction_no
