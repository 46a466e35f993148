-- Why the pose is accepted, or what was missing for that.
-- Takes run; gives sentence.
SELECT concat('the pose is ', verdict, ': ', reason) AS sentence
FROM pose
WHERE run_id = :run
