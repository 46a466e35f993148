-- Which poses were refined in the newest inspection, and why was each kept or dropped?
SELECT h.hypothesis_no, h.rule, h.found, h.least, h.distance, h.sentence
FROM why_hypothesis AS h
WHERE h.run_id = (SELECT max(pose.run_id) FROM pose)
ORDER BY h.hypothesis_no
