-- Release the lock that run/hold acquired.
-- Takes run; gives whether it was locked.
SELECT pg_advisory_unlock(:run)
