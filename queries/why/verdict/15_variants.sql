-- Of each object of which several variants were weighed, which one the pictures show, and what says so.
-- Takes run; gives sentence.
SELECT concat(words, ': ', evidence) AS sentence
FROM found_variant
WHERE run_id = :run
ORDER BY object_no
