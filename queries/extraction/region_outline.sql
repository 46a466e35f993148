-- The outlines of the regions of an extraction, ring by ring.
-- Takes extraction_id; gives region_no, ring_no, x, y.
SELECT region_no,
    ring_no,
    x,
    y
FROM region_outline
WHERE extraction_id = :extraction_id
ORDER BY region_no, ring_no, point_no
