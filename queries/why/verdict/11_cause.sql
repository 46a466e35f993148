-- What is the likeliest cause that the pose is not accepted, and what to do next.
-- Takes run; gives sentence.
<<<<<<< HEAD
SELECT unnest(ARRAY[concat('likely cause: ', likely_cause), concat('next: ', advice)]) AS sentence
FROM why_verdict_cause
WHERE run_id = :run
=======
WITH cause AS MATERIALIZED (SELECT likely_cause, advice FROM why_verdict_cause WHERE run_id = :run)
SELECT concat('likely cause: ', likely_cause) AS sentence FROM cause
UNION ALL
SELECT concat('next: ', advice) AS sentence FROM cause
>>>>>>> app
