-- Attributes that are numbers, of parts of given numbers and of objects of given names.
-- Takes parts, objects (arrays).  Gives owner (part or object), owner_name, name and value, in order of value.
SELECT 'part' AS owner, p.number AS owner_name, a.name, a.value_number AS value
FROM part_attribute AS a
JOIN part AS p ON p.id = a.part_id
WHERE p.number = ANY(:parts) AND a.value_number IS NOT NULL
UNION
SELECT 'object', o.name, a.name, a.value_number
FROM object_attribute AS a
JOIN object AS o ON o.id = a.object_id
WHERE o.name = ANY(:objects) AND a.value_number IS NOT NULL
ORDER BY value
