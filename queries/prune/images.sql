-- The images that some runs read and no other run that is there still reads.
-- Takes the relation asked_run of run_id; gives image_id.
SELECT i.id AS image_id
FROM image AS i
WHERE EXISTS (
        SELECT 1 FROM run_input AS r WHERE r.sha256 = i.sha256 AND r.run_id IN (SELECT run_id FROM asked_run))
    AND NOT EXISTS (
        SELECT 1
        FROM run_input AS r
        WHERE r.sha256 = i.sha256 AND r.run_id NOT IN (SELECT run_id FROM asked_run)
            AND r.run_id NOT IN (SELECT p.run_id FROM pruned_run AS p WHERE p.what = 'runs'))
ORDER BY i.id
