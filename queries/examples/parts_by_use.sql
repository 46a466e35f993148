-- How often does each part stand in the world?
SELECT p.number, count(*) AS placed
FROM occurrence AS o
JOIN part AS p ON p.id = o.part_id
JOIN current_world AS w ON w.world_id = o.world_id
WHERE w.name = 'demo_cell' /* world */
GROUP BY p.number
ORDER BY placed DESC, p.number
