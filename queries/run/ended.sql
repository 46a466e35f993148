-- Runs that ended, or whose processes were found dead.
-- Takes nothing; gives run_id.
SELECT run_id FROM run_event WHERE kind IN ('ended', 'found_dead') ORDER BY run_id
