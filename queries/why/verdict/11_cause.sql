-- What is the likeliest cause that the pose is not accepted, and what to do next.
-- Takes run; gives sentence.
SELECT unnest(ARRAY[concat('likely cause: ', likely_cause), concat('next: ', advice)]) AS sentence
FROM why_verdict_cause
WHERE run_id = :run
