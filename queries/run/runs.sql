-- Runs, the latest first.
-- Takes kind, state, verdict, part (its verdict) and text (in object, serial number, outcome or message, in whatever letters), null
-- for any, and low and high, numbers of the first and the last run to look at; gives run,
-- kind, object (those that an inspection was of, with their variants), state (running, finished, failed or killed), serial, verdict, pose_verdict, part_verdict,
-- findings, checked, in_view, changed, contradicted, not_confirmed and undecidable (how many parts and features), variant
-- (that the pictures show another), began_at, seconds, message.
SELECT s.run_id AS run, kind, o.object, state, serial, verdict, pose_verdict, part_verdict, findings, checked, in_view, changed,
    contradicted, not_confirmed, undecidable, variant, began_at, seconds, message
FROM run_summary AS s
LEFT JOIN (
    SELECT i.run_id, string_agg(concat_ws(' ', v.name, nullif(v.variant, '')), ', ' ORDER BY w.object_no) AS object
    FROM inspection AS i
    JOIN world_object AS w ON w.world_id = i.world_id AND w.role = 'inspected'
    JOIN object_variant AS v ON v.id = w.object_variant_id
    GROUP BY i.run_id
) AS o ON o.run_id = s.run_id
WHERE s.run_id BETWEEN :low AND :high
    AND (CAST(:kind AS TEXT) IS NULL OR kind = CAST(:kind AS TEXT))
    AND (CAST(:state AS TEXT) IS NULL OR state = CAST(:state AS TEXT))
    AND (CAST(:verdict AS TEXT) IS NULL OR verdict = CAST(:verdict AS TEXT))
    AND (CAST(:part AS TEXT) IS NULL OR part_verdict = CAST(:part AS TEXT))
    AND (CAST(:text AS TEXT) IS NULL
        OR strpos(lower(concat_ws(' ', o.object, serial, outcome, message)), lower(CAST(:text AS TEXT))) > 0)
ORDER BY s.run_id DESC
