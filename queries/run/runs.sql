-- Runs, the latest first.
-- Takes kind, state, verdict, part (its verdict) and text (in serial number, outcome or message, in whatever letters), null
-- for any, and low and high, numbers of the first and the last run to look at; gives run, kind, state (running, finished, failed or killed), serial, verdict, pose_verdict, part_verdict,
-- findings, checked, in_view, changed, contradicted, not_confirmed and undecidable (how many parts and features), variant
-- (that the pictures show another), began_at, seconds, message.
SELECT run_id AS run, kind, state, serial, verdict, pose_verdict, part_verdict, findings, checked, in_view, changed,
    contradicted, not_confirmed, undecidable, variant, began_at, seconds, message
FROM run_summary
WHERE run_id BETWEEN :low AND :high
    AND (CAST(:kind AS TEXT) IS NULL OR kind = CAST(:kind AS TEXT))
    AND (CAST(:state AS TEXT) IS NULL OR state = CAST(:state AS TEXT))
    AND (CAST(:verdict AS TEXT) IS NULL OR verdict = CAST(:verdict AS TEXT))
    AND (CAST(:part AS TEXT) IS NULL OR part_verdict = CAST(:part AS TEXT))
    AND (CAST(:text AS TEXT) IS NULL
        OR strpos(lower(concat_ws(' ', serial, outcome, message)), lower(CAST(:text AS TEXT))) > 0)
ORDER BY run_id DESC
