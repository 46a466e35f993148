-- Acquire the lock that shows that a run's process lives; the server releases it when the session ends.
-- Takes run; gives a row without meaning.
SELECT pg_advisory_lock(:run)
