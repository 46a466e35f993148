-- All that the model of an inspected object in a world has.
-- Takes world_id and object (its name in the world); gives world_id, occurrence_id, feature_no (null of parts) and path,
-- one row a part or feature.
WITH part AS (
    SELECT o.*
    FROM occurrence AS o
    JOIN world_object AS w ON w.world_id = o.world_id AND w.object_no = o.object_no AND w.role = 'inspected'
    WHERE o.world_id = :world_id AND o.kind = 'part' AND w.name = :object
)
SELECT world_id, id AS occurrence_id, CAST(NULL AS INTEGER) AS feature_no, path
FROM part
UNION ALL
SELECT p.world_id, p.id, f.feature_no, concat(p.path, '/', f.name)
FROM part AS p
JOIN feature AS f ON f.shape_id = p.shape_id
ORDER BY occurrence_id, feature_no
