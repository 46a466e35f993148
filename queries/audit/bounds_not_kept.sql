-- How many matching problems have a bound whose proof was not kept.
-- Takes nothing; gives problems.
SELECT count(*) AS problems FROM problem WHERE NOT bound_kept
