-- What is the likeliest cause that the pose is not accepted, and what to do next.
-- Takes run; gives sentence.
SELECT concat('likely cause: ', likely_cause) AS sentence
FROM why_verdict_cause
WHERE run_id = :run
UNION ALL
SELECT concat('next: ', advice) AS sentence
FROM why_verdict_cause
WHERE run_id = :run
