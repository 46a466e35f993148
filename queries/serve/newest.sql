-- What changes as soon as a run begins or ends.
-- Takes nothing; gives run (the newest, 0 where there is none) and ended (how many runs have).
SELECT (SELECT coalesce(max(id), 0) FROM run) AS run, count(*) AS ended
FROM run_event
WHERE kind IN ('ended', 'found_dead')
