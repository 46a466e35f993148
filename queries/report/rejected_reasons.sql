-- Why arcs of the pictures were left without a model arc.
-- Takes run_id; gives one row a camera and reason; how many and how long they are together, px.
SELECT camera, reason, count(*) AS arcs, sum(length) AS length
FROM rejected_arc
WHERE run_id = :run_id
GROUP BY camera, reason
ORDER BY camera, arcs DESC, reason
