-- What became of each pose that was refined.
-- Takes run; gives sentence.
SELECT sentence
FROM why_hypothesis
WHERE run_id = :run
ORDER BY hypothesis_no
