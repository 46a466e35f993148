-- How close did the newest inspection come to failing each rule of the verdict?
SELECT w.rule, w.value, w.gate, w.holds, w.sentence
FROM why_verdict AS w
WHERE w.run_id = (SELECT max(pose.run_id) FROM pose)
ORDER BY w.rule_no
