-- Which parts are of a material like %7075%?
SELECT p.number, p.name, a.value_text AS material
FROM part AS p
JOIN current_part_attribute AS a ON a.part_id = p.id AND a.name = 'material'
WHERE lower(a.value_text) LIKE '%7075%' /* material */
ORDER BY p.number, p.name
