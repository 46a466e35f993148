-- The row of an inspection that its title, colour, lists, files and exit status follow.
-- Takes run; gives no row or one.
SELECT verdict, pose_verdict, part_verdict, mood, findings, checked, in_view, changed, contradicted, not_confirmed,
    undecidable, variant, outcome AS words, (SELECT cause FROM why_verdict_cause WHERE run_id = :run) AS cause
FROM inspection_outcome
WHERE run_id = :run
