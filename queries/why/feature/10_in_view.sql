-- Whether and how far it is in view.
-- Takes run and path; gives sentence.
SELECT sentence
FROM why_part
WHERE run_id = :run AND path = :path
