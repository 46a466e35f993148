-- Which parts stand where in the newest revision of each world, asked of the files that relmodel export --parquet
-- writes.
-- Takes no parameter but three tables, of one store or of many: world, placed_body and object_node, the folders, with
-- the store_id that names theirs; gives store_id, cell, world, revision, occurrence_id, path, object and variant (as
-- loaded), role, number and name of the part, shape_id and world_from_occurrence m00 .. m23, sorted by store_id, world
-- and occurrence_id: the parts of the view occurrence.
-- Without the condition w.newest it gives every revision of each world. DuckDB and Spark SQL take it as it stands.
SELECT w.store_id, w.cell, w.name AS world, w.revision,
    CAST(b.object_no AS BIGINT) * 268435456 + n.node_no AS occurrence_id, b.name || n.path AS path,
    b.object, b.variant, b.role, n.number, n.name, n.shape_id,
    b.m00 * n.m00 + b.m01 * n.m10 + b.m02 * n.m20 AS m00,
    b.m00 * n.m01 + b.m01 * n.m11 + b.m02 * n.m21 AS m01,
    b.m00 * n.m02 + b.m01 * n.m12 + b.m02 * n.m22 AS m02,
    b.m00 * n.m03 + b.m01 * n.m13 + b.m02 * n.m23 + b.m03 AS m03,
    b.m10 * n.m00 + b.m11 * n.m10 + b.m12 * n.m20 AS m10,
    b.m10 * n.m01 + b.m11 * n.m11 + b.m12 * n.m21 AS m11,
    b.m10 * n.m02 + b.m11 * n.m12 + b.m12 * n.m22 AS m12,
    b.m10 * n.m03 + b.m11 * n.m13 + b.m12 * n.m23 + b.m13 AS m13,
    b.m20 * n.m00 + b.m21 * n.m10 + b.m22 * n.m20 AS m20,
    b.m20 * n.m01 + b.m21 * n.m11 + b.m22 * n.m21 AS m21,
    b.m20 * n.m02 + b.m21 * n.m12 + b.m22 * n.m22 AS m22,
    b.m20 * n.m03 + b.m21 * n.m13 + b.m22 * n.m23 + b.m23 AS m23
FROM world AS w
JOIN placed_body AS b ON b.store_id = w.store_id AND b.world = w.name
    AND w.revision BETWEEN b.first_revision AND coalesce(b.last_revision, w.revision)
JOIN object_node AS n ON n.store_id = b.store_id AND n.object_id = b.object_id AND n.body_no = b.body_no
WHERE w.newest
ORDER BY store_id, world, occurrence_id
