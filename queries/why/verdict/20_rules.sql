-- Each rule of the verdict, with what was found and what that was compared with.
-- Takes run; gives sentence.
SELECT concat(CASE WHEN holds THEN 'passed' ELSE 'failed' END, ' (', rule, '): ', sentence) AS sentence
FROM why_verdict
WHERE run_id = :run
ORDER BY rule_no
