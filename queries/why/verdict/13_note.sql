-- What was taken for given that the inputs do not say.
-- Takes run; gives sentence.
SELECT sentence
FROM inspection_sentence
WHERE run_id = :run AND kind = 'note'
ORDER BY sentence_no
