-- Which image arcs were rejected in the newest inspection, and why?
SELECT r.camera, r.reason, count(*) AS arcs, sum(r.length) AS pixels
FROM rejected_arc AS r
WHERE r.run_id = (SELECT max(pose.run_id) FROM pose)
GROUP BY r.camera, r.reason
ORDER BY r.camera, arcs DESC, r.reason
