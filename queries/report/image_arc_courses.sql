-- Where the arcs of a picture run: their edge elements.
-- Takes extraction_id; gives one row an element, arc by arc, in order along each; px.
SELECT image_arc_no, CAST(x AS DOUBLE PRECISION) AS x, CAST(y AS DOUBLE PRECISION) AS y
FROM edge_element
WHERE extraction_id = :extraction_id AND image_arc_no IS NOT NULL
ORDER BY image_arc_no, edge_element_no
