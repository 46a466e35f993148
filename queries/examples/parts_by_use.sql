-- How often does each part stand in the world demo_cell?
SELECT number, count(*) AS placed
FROM world_part
WHERE world = 'demo_cell' /* world */
GROUP BY number
ORDER BY placed DESC, number
