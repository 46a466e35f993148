-- Outlines of the regions of a picture.
-- Takes extraction_id; gives one row a corner, region by region and ring by ring; px.
SELECT region_no, ring_no, x, y
FROM region_outline
WHERE extraction_id = :extraction_id
ORDER BY region_no, ring_no, point_no
