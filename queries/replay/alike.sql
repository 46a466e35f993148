-- Objects that explain the same edges about as well as one that an inspection found, and are not found themselves.
-- Takes run; gives name.
SELECT DISTINCT v.name
FROM considered_object AS c
JOIN object_variant AS v ON v.id = c.object_variant_id
WHERE c.run_id = :run AND c.state = 'alike' AND v.name NOT IN (
    SELECT s.name
    FROM considered_object AS f
    JOIN object_variant AS s ON s.id = f.object_variant_id
    WHERE f.run_id = :run AND f.state = 'shown'
)
ORDER BY v.name
