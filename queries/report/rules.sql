-- The rules that a verdict rests on, with how close each came to its gate.
-- Takes run_id; gives one row a rule, in order.
SELECT rule, value, gate, holds, sentence
FROM why_verdict
WHERE run_id = :run_id
ORDER BY rule_no
