-- Findings of the newest load of a revision of a variant, by part.
-- Takes name, variant and revision; gives part_id (null: of the file as a whole), kind and how_many, in order.
SELECT f.part_id, f.kind, count(*) AS how_many
FROM load_finding AS f
WHERE f.run_id = (
    SELECT max(r.run_id)
    FROM load_report AS r
    JOIN object_variant AS v ON v.id = r.object_variant_id
    WHERE v.name = :name AND v.variant = :variant AND v.revision = :revision
)
GROUP BY f.part_id, f.kind
ORDER BY f.part_id, f.kind
