-- Let go of the lock that run/hold took.
-- Takes run; gives whether it was locked.
SELECT pg_advisory_unlock(:run)
