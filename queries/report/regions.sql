-- The outlines of the regions of a picture.
-- Takes extraction_id; gives one row a ring of a region, in order: region_no, x and y of its points (arrays), px.
SELECT region_no, array_agg(x ORDER BY point_no) AS x, array_agg(y ORDER BY point_no) AS y
FROM region_outline
WHERE extraction_id = :extraction_id
GROUP BY region_no, ring_no
ORDER BY region_no, ring_no
