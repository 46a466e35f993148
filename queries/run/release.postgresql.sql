-- Let go of the lock that run/hold took.
-- Takes run; gives whether it was held.
SELECT pg_advisory_unlock(:run)
