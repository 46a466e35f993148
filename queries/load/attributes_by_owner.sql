-- Attributes that are numbers, of parts by their numbers and of objects by their names.
-- Takes the relation sought (owner: part or object; name); gives owner, owner_name, name and value, in order of value.
SELECT s.owner, s.name AS owner_name, a.name, a.value_number AS value
FROM sought AS s
JOIN part AS p ON s.owner = 'part' AND p.number = s.name
JOIN part_attribute AS a ON a.part_id = p.id
WHERE a.value_number IS NOT NULL
UNION
SELECT s.owner, s.name, a.name, a.value_number
FROM sought AS s
JOIN object AS o ON s.owner = 'object' AND o.name = s.name
JOIN object_attribute AS a ON a.object_id = o.id
WHERE a.value_number IS NOT NULL
ORDER BY value
