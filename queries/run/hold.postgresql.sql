-- Hold the lock that shows that a run's process lives; it falls when the session ends.
-- Takes run; gives nothing of use.
SELECT pg_advisory_lock(:run)
