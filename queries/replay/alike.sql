-- Objects that explain the same edges about as well as the one that an inspection found.
-- Takes run; gives name.
SELECT v.name
FROM considered_object AS c
JOIN object_variant AS v ON v.id = c.object_variant_id
WHERE c.run_id = :run AND c.state = 'alike' AND v.name NOT IN (
    SELECT s.name
    FROM considered_object AS f
    JOIN object_variant AS s ON s.id = f.object_variant_id
    WHERE f.run_id = :run AND f.rank_no = 0
)
ORDER BY v.name
