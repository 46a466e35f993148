-- The relations of the store, lowest level first.
-- Takes nothing; gives level, relation, standing.
SELECT level, relation, standing
FROM sds_relation
ORDER BY CASE level
    WHEN 'catalogue' THEN 0 WHEN 'run' THEN 1 WHEN 'surface' THEN 2 WHEN 'part' THEN 3 WHEN 'object' THEN 4
    WHEN 'world' THEN 5 WHEN 'image' THEN 6 WHEN 'matching' THEN 7 ELSE 8 END, relation
